// SPDX-License-Identifier: Apache-2.0
// Values of options and positionals. What a value is, its type in the help says; of a pipeline, the pipeline itself.
#include <CLI/CLI.hpp>
#include <algorithm>

#include "commands.hpp"
#include "wishes.hpp"

namespace marrow::cli {
namespace {

/// Collects words that begin with what is typed.
class Beginning {
 public:
  explicit Beginning(const std::string& typed) : typed_(typed) {}
  void add(const std::string& word, const std::string& help = "") {
    if (word.starts_with(typed_)) wishes_.candidates.push_back({word, help});
  }
  Wishes wishes() { return std::move(wishes_); }

 private:
  const std::string& typed_;
  Wishes wishes_;
};

/// The choices of a type such as TEXT:{slurm,local}.
std::vector<std::string> choices_of(const std::string& type) {
  const std::size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return CLI::detail::split(type.substr(begin + 1, end - begin - 1), ',');
}

/// All nodes, or those of a kind.
void add_nodes(Beginning& beginning, const Catalogue& catalogue, const std::string& before = "",
               const std::string& kind = "") {
  for (const std::string& name : catalogue.node_names()) {
    const NodeInfo& node = *catalogue.find(name);
    if (kind.empty() || node.kind() == kind) beginning.add(before + name, node.summary);
  }
}

void add_kinds(Beginning& beginning, const Catalogue& catalogue, const std::string& after = "") {
  for (const std::string& name : catalogue.kind_names()) {
    const KindInfo* kind = catalogue.find_kind(name);
    beginning.add(name + after, kind ? kind->summary : "");
  }
}

Pipeline pipeline_at(const std::string& file, const Catalogue& catalogue) {
  Diagnostics diagnostics;
  return read_pipeline(file, {}, catalogue, diagnostics, false);
}

/// The node's name in a change: PART.NODE for the node PART/NODE.
std::string name_in_changes(const PipelineNode& node) {
  std::string name = node.id;
  std::replace(name.begin(), name.end(), '/', '.');
  return name;
}

/// The pipeline's inputs, also those of files that it extends, as NAME=.
void add_inputs(Beginning& beginning, const std::string& file) {
  for (const PipelineInput& input : pipeline_at(file, Catalogue()).inputs)
    if (!input.is_data) beginning.add(input.name + "=", input.help);
}

/// What changes one node: its options, and what all nodes have.
void add_changes(Beginning& beginning, const PipelineNode& node) {
  const std::string before = name_in_changes(node) + ".";
  beginning.add(before + "uses=", "another node in its place");
  beginning.add(before + "may_fail=", "whether the run goes on without it");
  for (const OptionInfo& option : node.info.options) beginning.add(before + option.name + "=", option.help);
}

void add_values_of_change(Beginning& beginning, const PipelineNode& node, const std::string& name,
                          const Catalogue& catalogue) {
  const std::string before = name_in_changes(node) + "." + name + "=";
  if (name == "uses") add_nodes(beginning, catalogue, before, node.info.kind());
  std::vector<std::string> values;
  if (name == "may_fail") values = {"true", "false"};
  for (const OptionInfo& option : node.info.options) {
    if (option.name != name) continue;
    values = option.choices;
    if (option.type == OptionType::boolean) values = {"true", "false"};
  }
  for (const std::string& value : values) beginning.add(before + value);
}

/// node.option=value: one part after the other.
void add_overrides(Beginning& beginning, const std::string& typed, const std::string& file) {
  const Catalogue catalogue;
  const std::size_t equals = typed.find('=');
  for (const PipelineNode& node : pipeline_at(file, catalogue).nodes) {
    const std::string before = name_in_changes(node) + ".";
    if (!typed.starts_with(before))
      beginning.add(before, node.info.name);
    else if (!node.repetition && equals == std::string::npos)
      add_changes(beginning, node);
    else if (!node.repetition)
      add_values_of_change(beginning, node, typed.substr(before.size(), equals - before.size()), catalogue);
  }
}

/// What the pipeline says, if the value has to do with it.
void add_of_pipeline(Beginning& beginning, const Typed& typed) {
  const std::string file = typed.given.empty() ? "" : typed.given[0];
  if (typed.place == "inputs")
    add_inputs(beginning, file);
  else if (typed.place == "--set" && !file.empty())
    add_overrides(beginning, typed.value, file);
  else if (typed.place == "--only")
    for (const PipelineOutput& output : pipeline_at(file, Catalogue()).outputs) beginning.add(output.name);
}

}  // namespace

Wishes values_for(const Typed& typed) {
  Beginning beginning(typed.value);
  const auto is = [&](const char* type) { return typed.type == type; };
  const bool is_value_of_input = typed.place == "inputs" && typed.value.find('=') != std::string::npos;
  if (is_value_of_input || is("FILE") || is("PATH") || typed.place == "pipeline") return {{}, true, false};
  if (is("FOLDER")) return {{}, false, true};
  if (is("WHOLE NUMBER") || is("NUMBER")) return {};
  for (const std::string& choice : choices_of(typed.type)) beginning.add(choice);
  if (is("LEVEL"))
    for (const char* level : {"debug", "info", "warning", "error"}) beginning.add(level);
  if (is("NODE")) add_nodes(beginning, Catalogue());
  if (is("KIND")) add_kinds(beginning, Catalogue());
  if (typed.command == "new node" && typed.place == "name") add_kinds(beginning, Catalogue(), ".");
  try {
    if (is("FILE NODE") && typed.before.empty()) return {{}, true, false};
    if (is("FILE NODE"))
      for (const PipelineNode& node : pipeline_at(typed.before[0], Catalogue()).nodes)
        beginning.add(node.id, node.info.name);
    add_of_pipeline(beginning, typed);
  } catch (const std::exception&) {  // there is no such pipeline, so nothing is known of it
  }
  return beginning.wishes();
}

}  // namespace marrow::cli
