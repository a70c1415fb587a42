// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <string>

#include "command_options.hpp"
#include "compare/comparison_folder.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// One of the things that marrow's commands take or make.
struct Thing {
  std::optional<Wanted> kind;  ///< nothing: no command takes it alone
  std::string what, advice;
};

std::string name_of(Wanted wanted) {
  if (wanted == Wanted::pipeline) return "a pipeline";
  return wanted == Wanted::experiment ? "an experiment" : "the folder of a run";
}

std::optional<Thing> thing_in_folder(const fs::path& folder) {
  std::error_code error;
  const std::string name = shell_path(folder);
  if (is_comparison(folder))
    return Thing{{},
                 "the folder of a comparison",
                 "its report is " + printable((folder / "report.html").string()) +
                     ", its cells are runs (cells/VARIANT/CASE/START), and this continues it: marrow compare "
                     "EXPERIMENT --out " +
                     name};
  if (fs::exists(folder / "run.json", error))
    return Thing{Wanted::run, name_of(Wanted::run),
                 "look at it by: marrow show " + name + "; repeat it by: marrow rerun " + name};
  if (fs::exists(folder / "case.yaml", error))
    return Thing{
        {}, "the folder of a case", "give it to a pipeline: marrow run PIPELINE case=" + shell_word(folder.string())};
  return std::nullopt;
}

/// By the first of the keys that only one kind of file has at its top level. Everything in the expression is bounded:
/// it is matched by recursion. `name`: the file as a word of a shell.
std::optional<Thing> thing_in_text(const std::string& text, const std::string& name) {
  static const std::regex kKey("(?:^|[\\n\\r]|\xEF\xBB\xBF)(experiment|variants|marrow|nodes|marrow-[a-z-]{1,40}) ?:");
  std::smatch key;
  if (!std::regex_search(text, key, kKey)) return std::nullopt;
  if (key[1] == "experiment" || key[1] == "variants")
    return Thing{Wanted::experiment, name_of(Wanted::experiment),
                 "look at it by: marrow compare " + name + " --dry-run"};
  if (key[1] == "marrow" || key[1] == "nodes")
    return Thing{Wanted::pipeline, name_of(Wanted::pipeline), "run it by: marrow run " + name};
  return Thing{{}, "a file of the format " + key[1].str(), "a pipeline names it in an option or an input"};
}

std::optional<Thing> thing_at(const fs::path& given, Wanted wanted) {
  std::error_code error;
  if (given != "-" && fs::is_directory(given, error)) return thing_in_folder(given);
  const fs::path folder = given.has_parent_path() ? given.parent_path() : fs::path(".");
  if (wanted == Wanted::run && fs::exists(folder / "run.json", error) && fs::exists(given, error))
    return Thing{{}, "a file of a run", "give the folder: " + printable(folder.string())};
  try {
    return thing_in_text(read_given_text(given, kMostSourceBytes), shell_path(given));
  } catch (const Error&) {
    return std::nullopt;
  }
}

/// "number, default 7": what may be given, and what counts otherwise.
std::string value_text(const PipelineInput& input) {
  std::string text = input.type;
  if (!input.over.empty()) text += " for each " + input.over;
  if (input.is_data) return text + (input.is_optional ? ", optional" : "") + "; given by a pipeline that uses this one";
  if (!input.has_default) return text + ", must be given";
  const bool is_text = input.type == "text" || input.type == "path";
  return text + ", default " + (is_text ? in_quotes(input.default_text) : input.default_text);
}

json interface_json(const Pipeline& pipeline) {
  json inputs = json::array(), outputs = json::array();
  for (const PipelineInput& input : pipeline.inputs) {
    json one = {{"name", input.name}, {"type", input.type}, {"help", input.help}};
    if (input.has_default) one["default"] = input.default_text;
    if (!input.over.empty()) one["over"] = input.over;
    if (input.is_data) one["optional"] = input.is_optional;
    inputs.push_back(std::move(one));
  }
  for (const PipelineOutput& output : pipeline.outputs) {
    const PortInfo& port = pipeline.output_of(output.source);
    outputs.push_back({{"name", output.name},
                       {"type", port.type.id},
                       {"axes", pipeline.axes_of(output.source)},
                       {"help", port.help}});
  }
  return {{"name", pipeline.name}, {"help", pipeline.help}, {"inputs", inputs}, {"outputs", outputs}};
}

/// Whether each input of the pipeline has a value.
bool has_inputs(const PipelineRequest& request, const Pipeline& pipeline) {
  const PipelineArguments arguments = arguments_of(request);
  const std::vector<PipelineInput>& inputs = pipeline.inputs;
  return std::all_of(inputs.begin(), inputs.end(), [&](const PipelineInput& input) {
    return !input.is_data && (input.has_default || find_named(arguments.inputs, input.name));
  });
}

/// What lies in the folder of a missing file and has nearly its name.
std::string nearest_in_folder(const fs::path& missing) {
  std::error_code error;
  fs::path folder = missing.parent_path();
  if (!fs::is_directory(folder, error)) {
    while (folder.has_relative_path() && !fs::is_directory(folder, error)) folder = folder.parent_path();
    return "the last folder on the way that there is: " + folder.string();
  }
  std::vector<std::string> names;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error))
    names.push_back(at->path().filename().string());
  return suggestion(missing.filename().string(), names);
}

/// Adds the paths in the node's own options that lead nowhere. Returns whether there are none.
bool has_its_files(const PipelineNode& node, Diagnostics& faults) {
  bool all = true;
  for (std::size_t option = 0; option < node.options.size(); ++option)
    for (const std::string& path : paths_of(node, option)) {
      std::error_code error;
      if (path.empty() || fs::exists(path, error)) continue;
      all = false;
      const Place& written = node.option_places[option];
      faults.add(written.file.empty() ? node.place : written,
                 "node " + in_quotes(node.id) + " would read " + path + ", which is not there",
                 nearest_in_folder(path));
    }
  return all;
}

/// Calls a node that needs no other one. Adds what it says if it fails.
void call_alone(const PipelineNode& node, const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& faults) {
  Pipeline alone;
  alone.name = pipeline.name;
  alone.file = pipeline.file;
  alone.nodes = {node};
  for (std::size_t i = 0; i < node.info.outputs.size(); ++i)
    alone.outputs.push_back({node.info.outputs[i].name, {node.info.outputs[i].name, node.place, 0, int(i), {}}});
  const NodeRecord called = run_pipeline(alone, catalogue, {}).nodes[0];
  if (called.status == NodeRecord::Status::failed)
    faults.add(node.place, "node " + in_quotes(node.id) + ": " + called.reason);
}

void add_faults(const Pipeline& pipeline, const Catalogue& catalogue, bool inputs_are_given, Diagnostics& faults) {
  const std::vector<bool> needed = pipeline.needed();
  for (std::size_t i = 0; i < pipeline.nodes.size(); ++i) {
    const PipelineNode& node = pipeline.nodes[i];
    if (!needed[i] || node.may_fail || node.stands_for_input) continue;
    if (node.repetition) add_faults(node.repetition->body, catalogue, inputs_are_given, faults);
    const bool has_all = has_its_files(node, faults);
    const std::vector<std::string>& traits = node.info.traits;
    if (has_all && inputs_are_given && node.wires.empty() &&
        std::find(traits.begin(), traits.end(), "names_files") != traits.end())
      call_alone(node, pipeline, catalogue, faults);
  }
}

/// A fault for each file or folder that a needed node would read and that is not there, at the place that names it.
/// Nodes that may fail are left out. Where a file names further files, its node has the trait `names_files`: it is
/// called, in a process of its own, and its refusal is the fault. That needs `inputs_are_given`: all inputs of the
/// pipeline have values.
Diagnostics faults_of_files(const Pipeline& pipeline, const Catalogue& catalogue, bool inputs_are_given) {
  Diagnostics faults;
  add_faults(pipeline, catalogue, inputs_are_given, faults);
  return faults;
}

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

/// Prints the pipeline's inputs, one a line: name, type, default and help.
void print_inputs(const Pipeline& pipeline) {
  for (const PipelineInput& input : pipeline.inputs)
    std::printf("  input %s (%s)%s%s\n", printable(input.name).c_str(), printable(value_text(input)).c_str(),
                input.help.empty() ? "" : ": ", printable(input.help).c_str());
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

void expect_given(const fs::path& given, Wanted wanted) {
  if (given.empty()) throw Error("the path of " + name_of(wanted) + " is empty; a variable may have no value");
  if (given == "-" && wanted != Wanted::pipeline)
    throw Error("- is the standard input, which holds no " + name_of(wanted).substr(name_of(wanted).find(' ') + 1) +
                "; give its path (./- is a file of that name)");
  const std::optional<Thing> thing = thing_at(given, wanted);
  if (thing && thing->kind != wanted)
    throw Error(given.string() + ": this is " + thing->what + ", not " + name_of(wanted) + "; " + thing->advice);
}

int inspect_pipeline(const std::filesystem::path& file, bool as_json) {
  const Catalogue catalogue;
  Pipeline pipeline;
  if (!load({file, {}, {}}, catalogue, pipeline, false)) return 2;
  if (as_json) {
    print_as_json(interface_json(pipeline));
    return 0;
  }
  std::printf("%s\n", printable(pipeline.name).c_str());
  const std::string help = pipeline.help.substr(0, pipeline.help.find_last_not_of('\n') + 1);
  if (!help.empty()) std::printf("  %s\n", printable(help).c_str());
  std::printf("\n");
  print_inputs(pipeline);
  for (const PipelineOutput& output : pipeline.outputs) {
    const PortInfo& port = pipeline.output_of(output.source);
    const std::vector<std::string> axes = pipeline.axes_of(output.source);
    std::printf("  output %s (%s%s): %s\n", printable(output.name).c_str(), port.type.id.c_str(),
                axes.empty() ? "" : printable(" for each " + joined(axes, " and ")).c_str(),
                printable(port.help).c_str());
  }
  return 0;
}

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

// What a pipeline takes and gives: `marrow inspect FILE.yaml`, and the inputs in `marrow check`.

bool load(const PipelineRequest& request, const Catalogue& catalogue, Pipeline& pipeline, bool inputs_required) {
  const Diagnostics faults = read_requested(request, catalogue, pipeline, inputs_required);
  if (!faults.empty()) print_faults(faults);
  return faults.empty();
}

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

}  // namespace marrow::cli
