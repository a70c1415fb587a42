// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "command_options.hpp"
#include "commands.hpp"
#include "drawn_graph.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/settings.hpp"
#include "marrow/runtime/run/run_folder.hpp"
#include "missing_files.hpp"

namespace marrow::cli {

std::vector<std::pair<std::string, std::string>> pairs_of(const std::vector<std::string>& texts, const char* form) {
  std::vector<std::pair<std::string, std::string>> result;
  for (const std::string& text : texts) {
    const std::size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) throw Error("'" + text + "' is not of the form " + form);
    result.emplace_back(text.substr(0, equals), text.substr(equals + 1));
  }
  return result;
}

PipelineArguments arguments_of(const PipelineRequest& request) {
  PipelineArguments arguments;
  PipelineArguments of_files;
  Diagnostics faults;
  for (const std::filesystem::path& file : request.settings) add_settings(file, of_files, faults);
  if (!faults.empty()) throw Error(faults.text());
  for (auto& [name, value] : pairs_of(request.inputs, "name=value")) {
    for (const InputValue& before : arguments.inputs)
      if (before.name == name)
        throw Error("the input '" + name + "' is given twice, as '" + before.value + "' and as '" + value +
                    "'; a run has one value of each input");
    arguments.inputs.push_back({name, value});
  }
  // Of two values of an input, the pipeline takes the last.
  arguments.inputs.insert(arguments.inputs.begin(), of_files.inputs.begin(), of_files.inputs.end());
  arguments.overrides = std::move(of_files.overrides);
  for (auto& [key, value] : pairs_of(request.overrides, "node.option=value"))
    arguments.overrides.push_back({key, value, {}, int(request.settings.size())});
  return arguments;
}

nlohmann::json faults_json(const Diagnostics& diagnostics) {
  nlohmann::json list = nlohmann::json::array();
  for (const Diagnostic& item : diagnostics.sorted())
    list.push_back({{"file", item.place.file},
                    {"line", item.place.line},
                    {"column", item.place.column},
                    {"message", item.message},
                    {"hint", item.hint}});
  return list;
}

void print_faults(const Diagnostics& diagnostics) {
  std::fprintf(stderr, "%s%s\n", diagnostics.text().c_str(), counted(diagnostics.size(), "error").c_str());
}

namespace {

/// A program that calls marrow may add to what its user gave, so the last one counts.
std::vector<std::string> notes_on_repeated(const std::vector<Override>& overrides) {
  std::vector<std::string> notes;
  std::map<std::string, std::string> given;
  for (const Override& one : overrides) {
    if (!one.place.file.empty()) continue;  // a file of settings, which --set may change
    const auto [before, is_new] = given.try_emplace(one.key, one.value);
    if (!is_new)
      notes.push_back("--set " + one.key + " is given twice: " + in_quotes(one.value) + " counts, " +
                      in_quotes(before->second) + " does not");
    before->second = one.value;
  }
  return notes;
}

/// Reads the pipeline that a command names. Returns its faults.
Diagnostics read_requested(const PipelineRequest& request, const Catalogue& catalogue, Pipeline& pipeline,
                           bool inputs_required) {
  expect_given(request.file, Wanted::pipeline);
  Diagnostics diagnostics;
  const PipelineArguments arguments = arguments_of(request);
  pipeline = read_pipeline(request.file, arguments, catalogue, diagnostics, inputs_required);
  for (std::string& note : notes_on_repeated(arguments.overrides)) pipeline.notes.push_back(std::move(note));
  check_writers(pipeline, catalogue, diagnostics);
  return diagnostics;
}

}  // namespace

bool load(const PipelineRequest& request, const Catalogue& catalogue, Pipeline& pipeline, bool inputs_required) {
  const Diagnostics faults = read_requested(request, catalogue, pipeline, inputs_required);
  if (!faults.empty()) print_faults(faults);
  return faults.empty();
}

namespace {

/// Whether each input of the pipeline has a value.
bool has_inputs(const PipelineRequest& request, const Pipeline& pipeline) {
  const PipelineArguments arguments = arguments_of(request);
  const std::vector<PipelineInput>& inputs = pipeline.inputs;
  return std::all_of(inputs.begin(), inputs.end(), [&](const PipelineInput& input) {
    return !input.is_data && (input.has_default || find_named(arguments.inputs, input.name));
  });
}

void print_missing_files(const Diagnostics& missing) {
  for (const Diagnostic& one : missing.sorted()) {
    const std::string text = formatted("{}:{}: ", one.place.file, one.place.line) + one.message;
    const std::string hint = one.hint.empty() ? "" : "; " + one.hint;
    std::printf("  missing: %s\n", printable_lines(text + hint).c_str());
  }
}

int check(const PipelineRequest& request, bool json) {
  const Catalogue catalogue;
  Pipeline pipeline;
  const Diagnostics faults = read_requested(request, catalogue, pipeline, false);
  if (json) print_as_json(faults_json(faults));
  if (!faults.empty() && !json) print_faults(faults);
  if (!faults.empty() || json) return faults.empty() ? 0 : 2;
  std::printf("%s: good; %zu nodes, %zu outputs\n", printable(request.file.string()).c_str(), pipeline.nodes.size(),
              pipeline.outputs.size());
  print_inputs(pipeline);
  for (const PipelineNode& node : pipeline.nodes) {
    if (!node.mapped_axes.empty())
      std::printf("  %s is called for each %s\n", node.id.c_str(), joined(node.mapped_axes, " and ").c_str());
    if (node.repetition)
      std::printf("  %s runs a body of %zu nodes: %s\n", node.id.c_str(), node.repetition->alone.nodes.size(),
                  passes_text(*node.repetition).c_str());
  }
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i)
    if (!needed[i]) std::printf("  note: %s feeds no output and is not run\n", pipeline.nodes[i].id.c_str());
  if (pipeline.only_inside)
    std::printf("  note: no command runs it, but the program itself (only_inside): no file need hold its outputs\n");
  for (const std::string& note : pipeline.notes) std::printf("  note: %s\n", printable(note).c_str());
  print_missing_files(faults_of_files(pipeline, catalogue, has_inputs(request, pipeline)));
  return 0;
}

}  // namespace

int print_resolved(const PipelineRequest& request) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load(request, catalogue, pipeline, false)) return 2;
  std::fputs(resolved_yaml_with_places(pipeline).c_str(), stdout);
  return 0;
}

void add_check(CLI::App& app, int& code) {
  const auto request = std::make_shared<PipelineRequest>();
  const auto as_json = std::make_shared<bool>(false);
  CLI::App* command =
      app.add_subcommand("check", "check a pipeline and show every fault, and each file that it would miss");
  add_pipeline_arguments(command, *request);
  command->add_flag("--json", *as_json, "print the faults as JSON");
  command->callback([request, as_json, &code] { code = check(*request, *as_json); });
  say_that_libraries_are_described(command);
}

}  // namespace marrow::cli
