// SPDX-License-Identifier: Apache-2.0
// Parts: nodes that are pipelines. A run does not know them, because the nodes of their files take their place.

#include <algorithm>
#include <functional>
#include <set>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/pipeline_resolved.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostInside = 8;

/// A reference as written: its first word, and the rest with its dot.
struct Words {
  std::string first, rest;
  explicit Words(const std::string& text) : first(text.substr(0, text.find('.'))), rest(text.substr(first.size())) {}
};

/// What a reference is replaced by: other references (several if it was wired to a list), or nothing.
struct Replacement {
  std::vector<std::string> texts;
  bool is_list = false;
  std::optional<Place> place;  ///< where they are written
};
using Replace = std::function<std::optional<Replacement>(const std::string& text, const Place& place)>;

/// Replaces the references in the value of a wire. Returns whether something is left of it.
bool replace_references(WrittenValue& value, const Replace& replace, Diagnostics& diagnostics) {
  if (value.value.IsScalar()) {
    const auto by = replace(value.value.Scalar(), value.place);
    if (!by) return true;
    if (by->texts.empty()) return false;
    YAML::Node made(by->is_list ? YAML::NodeType::Sequence : YAML::NodeType::Scalar);
    for (const std::string& text : by->texts)
      if (by->is_list)
        made.push_back(text);
      else
        made = text;
    value.value = made;
    value.is_override = value.is_override || by->is_list;
    if (by->place) value.place = *by->place;
    return true;
  }
  if (!value.value.IsSequence()) return true;
  YAML::Node made(YAML::NodeType::Sequence);
  const StrictYaml yaml = yaml_of(value, diagnostics);
  bool is_changed = false;
  for (const YAML::Node& item : value.value) {
    const auto by = item.IsScalar() ? replace(item.Scalar(), yaml.place(item)) : std::nullopt;
    is_changed |= by.has_value();
    if (!by)
      made.push_back(item);
    else
      for (const std::string& text : by->texts) made.push_back(text);
  }
  if (!is_changed) return true;
  value.value = made;
  value.is_override = true;
  return made.size() > 0;
}

class PartReader {
 public:
  PartReader(WrittenPipeline& pipeline, const PipelineReading& reading, const Catalogue& catalogue,
             Diagnostics& diagnostics)
      : pipeline_(pipeline),
        reading_(reading),
        catalogue_(catalogue),
        diagnostics_(diagnostics),
        input_texts_(pipeline, diagnostics) {}

  void put_in() {
    if (reading_.use != PipelineReading::Use::part) add_stand_ins();
    std::vector<WrittenNode> nodes;
    for (WrittenNode& node : pipeline_.nodes) {
      if (!has_place(node)) break;
      if (node.repetition || !is_part(node.uses)) {
        if (!node.repetition) std::move(node.changes.begin(), node.changes.end(), std::back_inserter(node.options));
        nodes.push_back(std::move(node));
        continue;
      }
      WrittenPipeline inner = read(node);
      std::move(inner.nodes.begin(), inner.nodes.end(), std::back_inserter(nodes));
    }
    pipeline_.nodes = std::move(nodes);
    const Replace replace = [&](const std::string& text, const Place& place) { return of_part(text, place); };
    for (WrittenNode& node : pipeline_.nodes)
      std::erase_if(node.wires,
                    [&](WrittenEntry& wire) { return !replace_references(wire.value, replace, diagnostics_); });
    for (WrittenEntry& output : pipeline_.outputs) replace_references(output.value, replace, diagnostics_);
    for (const std::string& id : faulty_) pipeline_.nodes.push_back({id});
    pipeline_.inputs_of_parts = input_texts_.used;
  }

 private:
  bool has_place(const WrittenNode& node) {
    std::size_t& left = *reading_.nodes_left;
    if (reading_.use != PipelineReading::Use::part || left == 0) return left > 0;
    if (--left == 0)
      diagnostics_.add(node.place, formatted("the parts of the pipeline have {} nodes or more", kMostNodesOfParts),
                       "use fewer parts in each other");
    return left > 0;
  }

  void add_stand_ins() {
    std::vector<WrittenNode> nodes;
    for (const DeclaredInput& input : pipeline_.inputs->all) {
      if (!input.data) continue;
      if (reading_.use == PipelineReading::Use::alone)
        diagnostics_.add(input.place,
                         "input " + in_quotes(input.name) + " is data of type " + input.type +
                             ", which only another pipeline can give",
                         "use this file as a node of it:  uses: " + pipeline_.file.filename().string());
      WrittenNode node;
      node.id = input.name;
      node.place = input.place;
      node.stands_for = PortInfo{input.name, input.help, *input.data, input.is_optional, input.over};
      nodes.push_back(std::move(node));
    }
    pipeline_.nodes.insert(pipeline_.nodes.begin(), std::make_move_iterator(nodes.begin()),
                           std::make_move_iterator(nodes.end()));
  }

  /// The nodes of the part that `node` uses, called and wired as in the whole.
  WrittenPipeline read(const WrittenNode& node) {
    const std::string who = "node " + in_quotes(node.id);
    faulty_.insert(node.id);
    if (node.may_fail)
      diagnostics_.add(node.place, who + " is a pipeline, and 'may_fail' is for single nodes",
                       "say it of one of its nodes, as  set: {NODE.may_fail: true}");
    const fs::path file = node.uses_folder / node.uses;
    PipelineReading reading;
    reading.use = PipelineReading::Use::part;
    reading.inside = reading_.inside;
    reading.nodes_left = reading_.nodes_left;
    std::error_code ignored;
    reading.inside.push_back(fs::weakly_canonical(file, ignored));
    if (std::count(reading.inside.begin(), reading.inside.end(), reading.inside.back()) > 1) {
      diagnostics_.add(node.uses_place, in_quotes(node.uses) + " uses itself: a pipeline must not be its own part");
      return {};
    }
    if (reading.inside.size() > kMostInside) {
      diagnostics_.add(node.uses_place, formatted("parts lie more than {} deep in each other", kMostInside));
      return {};
    }
    if (!fs::exists(file, ignored)) {
      diagnostics_.add(node.uses_place, "there is no file " + in_quotes(node.uses) + " to use as a node",
                       nearest_file(file));
      return {};
    }
    reading.changes = node.changes;
    const std::vector<std::string> unknown = give_texts(node, reading);
    const fs::path shown = pipeline_.file.is_absolute() ? file.lexically_normal() : fs::proximate(file);
    const std::size_t faults = diagnostics_.size();
    WrittenPipeline inner = read_written_pipeline(shown, reading, catalogue_, diagnostics_);
    pipeline_.files.insert(pipeline_.files.end(), inner.files.begin(), inner.files.end());
    if (inner.nodes.empty()) return {};
    pipeline_.notes.insert(pipeline_.notes.end(), inner.notes.begin(), inner.notes.end());
    if (diagnostics_.size() == faults) check_inputs(node, *inner.inputs, unknown);
    wire(node, inner);
    if (diagnostics_.size() > faults) return inner;
    faulty_.erase(node.id);
    outputs_[node.id] = inner.outputs;
    return inner;
  }

  /// Gives the part the texts that are written as options of its node. Returns the names of those that are unknown.
  std::vector<std::string> give_texts(const WrittenNode& node, PipelineReading& reading) {
    std::vector<std::string> unknown;
    for (const auto& [name, value] : node.options) {
      if (!value.value.IsScalar()) {
        diagnostics_.add(value.place, "input " + in_quotes(name) + " of " + node.uses + " must be one value");
        unknown.push_back(name);
        continue;
      }
      const auto text = input_texts_.put_into(value.value.Scalar(), value.place, value.inputs.get());
      if (text)
        reading.inputs.push_back({name, *text, in_folder(value)});
      else
        unknown.push_back(name);
    }
    return unknown;
  }

  /// The value's place. A relative path of the command line starts at the working folder.
  static Place in_folder(const WrittenValue& value) { return value.place.line ? value.place : Place{}; }

  void check_inputs(const WrittenNode& node, const DeclaredInputs& inputs, const std::vector<std::string>& unknown) {
    const std::string who = "node " + in_quotes(node.id);
    std::vector<std::string> ports;
    for (const DeclaredInput& input : inputs.all) {
      const std::string help = input.help.empty() ? "" : " (" + input.help + ")";
      if (input.data) {
        ports.push_back(input.name);
        if (!input.is_optional && !find_named(node.wires, input.name))
          diagnostics_.add(node.place, who + ": input " + in_quotes(input.name) + " of " + node.uses + " is not wired",
                           "add  in: {" + input.name + ": ...}  with " + input.type + help);
      } else if (contains(inputs.missing, input.name) && !contains(unknown, input.name)) {
        diagnostics_.add(node.place, who + ": input " + in_quotes(input.name) + " of " + node.uses + " has no value",
                         "add  with: {" + input.name + ": ...}" + help);
      }
    }
    for (const auto& [name, value] : node.wires)
      if (!contains(ports, name))
        diagnostics_.add(value.place, in_quotes(node.uses) + " has no input " + in_quotes(name) + " of data",
                         suggested(diagnostics_, name, ports));
  }

  /// Gives the part's nodes their names in the whole, and its inputs what the node is wired to.
  void wire(const WrittenNode& node, WrittenPipeline& inner) {
    const Replace replace = [&](const std::string& text, const Place& place) -> std::optional<Replacement> {
      const Words words(text);
      const auto input = std::find_if(inner.inputs->all.begin(), inner.inputs->all.end(),
                                      [&](const DeclaredInput& one) { return one.data && one.name == words.first; });
      if (input == inner.inputs->all.end()) {
        if (!words.first.empty()) return Replacement{{node.id + "/" + text}, false, std::nullopt};
        return std::nullopt;
      }
      const WrittenEntry* given = find_named(node.wires, input->name);
      if (!given) return input->is_optional ? Replacement{} : Replacement{{node.id}, false, {}};  // a fault already
      return given_to(*given, words.rest, place);
    };
    for (WrittenNode& one : inner.nodes) {
      one.id = node.id + "/" + one.id;
      std::erase_if(one.wires,
                    [&](WrittenEntry& wire) { return !replace_references(wire.value, replace, diagnostics_); });
    }
    std::erase_if(inner.outputs,
                  [&](WrittenEntry& output) { return !replace_references(output.value, replace, diagnostics_); });
  }

  Replacement given_to(const WrittenEntry& given, const std::string& items, const Place& place) {
    Replacement by{{}, given.value.value.IsSequence(), given.value.place};
    const auto add = [&](const YAML::Node& one) {
      if (one.IsScalar())
        by.texts.push_back(one.Scalar() + items);
      else
        diagnostics_.add(given.value.place, "input " + in_quotes(given.name) + " must name a node",
                         "write it as  " + given.name + ": node  or  node.output");
    };
    if (by.is_list && !items.empty())
      diagnostics_.add(place, "item " + in_quotes(items.substr(1)) + " of input " + in_quotes(given.name) +
                                  " cannot be picked, because a list of references is wired to it");
    if (by.is_list)
      for (const YAML::Node& one : given.value.value) add(one);
    else
      add(given.value.value);
    return by;
  }

  /// What makes the output of a part that a reference names, or nothing if it names no part.
  std::optional<Replacement> of_part(const std::string& text, const Place& place) {
    Replacement by{{text}, false, std::nullopt};
    for (std::size_t steps = 0; by.texts.size() == 1; ++steps) {  // a part may give out what it was given
      const auto next = output_of(by.texts[0], place);
      if (!next) break;
      if (steps > outputs_.size()) {
        diagnostics_.add(place, in_quotes(text) + " names parts that give each other the same value in a circle");
        faulty_.insert(Words(text).first);
        return std::nullopt;
      }
      by = *next;
    }
    if (by.texts.size() == 1 && by.texts[0] == text && !by.is_list) return std::nullopt;
    return by;
  }

  std::optional<Replacement> output_of(const std::string& text, const Place& place) {
    const Words words(text);
    const auto found = outputs_.find(words.first);
    if (found == outputs_.end()) return std::nullopt;
    const std::vector<WrittenEntry>& outputs = found->second;
    const Words named(words.rest.empty() ? "" : words.rest.substr(1));
    const WrittenEntry* output = find_named(outputs, named.first);
    std::string items = named.rest;
    if (!output && outputs.size() == 1) {
      output = &outputs[0];
      items = words.rest;
    }
    if (output && output->value.value.IsScalar()) return Replacement{{output->value.value.Scalar() + items}, false, {}};
    if (output) return given_to(*output, items, place);
    const std::vector<std::string> names = names_of(outputs);
    if (named.first.empty())
      diagnostics_.add(place, "node " + in_quotes(words.first) + " has several outputs",
                       "say which: " + words.first + "." + joined(names, ", "));
    else
      diagnostics_.add(place, "node " + in_quotes(words.first) + " has no output " + in_quotes(named.first),
                       suggested(diagnostics_, named.first, names));
    faulty_.insert(words.first);
    return std::nullopt;
  }

  WrittenPipeline& pipeline_;
  const PipelineReading& reading_;
  const Catalogue& catalogue_;
  Diagnostics& diagnostics_;
  InputTexts input_texts_;
  std::map<std::string, std::vector<WrittenEntry>> outputs_;  ///< of the parts, by the ids of their nodes
  std::set<std::string> faulty_;  ///< ids of parts whose faults were reported; nodes of unknown kind stand for them
};

}  // namespace

void put_parts_in(WrittenPipeline& pipeline, const PipelineReading& reading, const Catalogue& catalogue,
                  Diagnostics& diagnostics) {
  PartReader(pipeline, reading, catalogue, diagnostics).put_in();
}

}  // namespace marrow
