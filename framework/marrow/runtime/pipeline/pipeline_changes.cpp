// SPDX-License-Identifier: Apache-2.0
// Changes of a pipeline after its nodes are read: overrides of the command line, and `set` in files.
#include "marrow/runtime/pipeline/pipeline_text.hpp"

#include <algorithm>

#include "marrow/runtime/pipeline/given_value.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow {
namespace {

/// A change, and the two parts of its name: the node, and what of it is changed.
struct SplitChange {
  const WrittenEntry* change;
  std::string id, what;
};

bool names_node(const WrittenValue& value, const std::string& id) {
  const auto is_it = [&](const YAML::Node& one) {
    return one.IsScalar() && one.Scalar().substr(0, one.Scalar().find('.')) == id;
  };
  if (!value.value.IsSequence()) return is_it(value.value);
  return std::any_of(value.value.begin(), value.value.end(), is_it);
}

class Changer {
 public:
  Changer(WrittenPipeline& pipeline, Diagnostics& diagnostics) : pipeline_(pipeline), diagnostics_(diagnostics) {}

  void apply(const std::vector<WrittenEntry>& changes) {
    std::vector<SplitChange> split;
    for (const WrittenEntry& one : changes) {
      const std::size_t dot = one.name.find('.');
      if (dot == std::string::npos || dot + 1 == one.name.size())
        diagnostics_.add(one.value.place,
                         "an override is node.option=value, node.uses=kind.name, node.may_fail=true or "
                         "node.in.port=reference");
      else
        split.push_back(in_part({&one, one.name.substr(0, dot), one.name.substr(dot + 1)}));
    }
    std::vector<SplitChange> added;
    for (const SplitChange& one : split)
      if (one.what == "uses" && !node_of(one.id)) {
        added.push_back(one);
        pipeline_.nodes.push_back({one.id, one.change->value.place});
      }
    for (const SplitChange& one : split) apply(one);
    for (const SplitChange& one : added) check_used(one);
  }

 private:
  WrittenNode* node_of(const std::string& id) {
    const auto found = std::find_if(pipeline_.nodes.begin(), pipeline_.nodes.end(),
                                    [&](const WrittenNode& node) { return node.id == id; });
    return found == pipeline_.nodes.end() ? nullptr : &*found;
  }

  /// The nodes of a part are called PART/NODE wherever they are shown, so a change may call them so, too.
  SplitChange in_part(SplitChange one) {
    const std::size_t slash = one.id.find('/');
    const WrittenNode* part = slash == std::string::npos ? nullptr : node_of(one.id.substr(0, slash));
    if (part && is_part(part->uses)) {
      one.what = one.id.substr(slash + 1) + "." + one.what;
      one.id.resize(slash);
    }
    return one;
  }

  void fault_of_unknown(const SplitChange& one, const std::string& hint = "") {
    std::vector<std::string> ids;
    for (const WrittenNode& node : pipeline_.nodes)
      if (node.id != one.id) ids.push_back(node.id);
    const std::string nearest = suggestion(one.id, ids);
    diagnostics_.add(one.change->value.place, "the pipeline has no node " + in_quotes(one.id),
                     hint.empty() || nearest.empty() ? nearest + hint : nearest + "; " + hint);
  }

  /// A node that a change adds must be used: else its name may be a typing error.
  void check_used(const SplitChange& one) {
    const auto uses_it = [&](const std::vector<WrittenEntry>& entries) {
      return std::any_of(entries.begin(), entries.end(),
                         [&](const WrittenEntry& entry) { return names_node(entry.value, one.id); });
    };
    bool is_used = uses_it(pipeline_.outputs);
    for (const WrittenNode& node : pipeline_.nodes) is_used |= node.id != one.id && uses_it(node.wires);
    if (!is_used) fault_of_unknown(one, "a node that is added must be wired to another, by  NODE.in.PORT");
  }

  void apply(const SplitChange& one) {
    WrittenNode* node = node_of(one.id);
    if (!node) return fault_of_unknown(one);
    const WrittenValue& value = one.change->value;
    if (node->repetition && set_repetition(*node, one)) return;
    if (node->repetition && one.what == "uses")
      return diagnostics_.add(value.place,
                              "node " + in_quotes(one.id) + " repeats a body, so no other node can take its place",
                              "a node of the body is changed by  " + one.id + ".body.NODE.uses=kind.name");
    StrictYaml yaml = yaml_of(value, diagnostics_);
    if (one.what == "uses")
      use_other(*node, *one.change, yaml.text(value.value, value.place, "uses"));
    else if (one.what == "may_fail")
      node->may_fail = yaml.boolean(value.value, value.place, may_fail_of(one.id)).value_or(false);
    else if (!one.what.starts_with("in.") && one.what.find('.') != std::string::npos)
      node->changes.push_back({one.what, value});
    else
      set_entry(*node, one.what, value);
  }

  /// `what`: an option, or in.port.
  static void set_entry(WrittenNode& node, const std::string& what, const WrittenValue& value) {
    const bool is_wire = what.starts_with("in.");
    const std::string name = is_wire ? what.substr(3) : what;
    auto& target = is_wire ? node.wires : node.options;
    const auto old =
        std::find_if(target.begin(), target.end(), [&](const WrittenEntry& one) { return one.name == name; });
    if (old == target.end())
      target.push_back({name, value});
    else if (value.value.IsNull())
      target.erase(old);
    else
      old->value = value;
  }

  void use_other(WrittenNode& node, const WrittenEntry& change, const std::optional<std::string>& name) {
    if (!name) return;
    if (name->empty()) {
      diagnostics_.add(change.value.place, "node " + in_quotes(node.id) + " does not say what it uses",
                       "write it as  " + change.name + "=kind.name");
      return;
    }
    const std::string before = node.uses;
    const bool drops = set_uses(node, *name, change.value.place, change.value.folder, change.value.layer);
    if (drops && change.value.is_override)
      pipeline_.notes.push_back("node " + in_quotes(node.id) + ": the options written for " + before +
                                " are not used by " + *name);
  }

  /// Applies a change of the repetition. Returns false if something else is changed.
  bool set_repetition(WrittenNode& node, const SplitChange& one) {
    static const std::vector<std::string> kKeys{"at_most", "until", "if_pass_fails"};
    const WrittenValue& value = one.change->value;
    if (one.what.starts_with("body.")) {
      node.changes.push_back({one.what.substr(5), value});
      return true;
    }
    if (!contains(kKeys, one.what)) return false;
    StrictYaml yaml = yaml_of(value, diagnostics_);
    set_passes(node, one.what, value.value, value.place, yaml);
    return true;
  }

  WrittenPipeline& pipeline_;
  Diagnostics& diagnostics_;
};

}  // namespace

std::vector<WrittenEntry> changes_in(const YamlEntry& section, const PipelineLayer& layer) {
  std::vector<WrittenEntry> changes;
  for (const YamlEntry& entry : layer.yaml.map(section.value, section.place, "set"))
    changes.push_back({entry.key, layer.value_of(entry)});
  return changes;
}

std::vector<WrittenEntry> changes_of(const std::vector<Override>& overrides, Diagnostics& diagnostics) {
  std::vector<WrittenEntry> changes;
  for (const Override& one : overrides) {
    const Place place = one.place.file.empty() ? Place{"--set " + one.key + "=" + one.value} : one.place;
    if (const auto value = given_value(one.value, place, diagnostics))
      changes.push_back({one.key, {place, *value, folder_of(one.place), nullptr, one.layer, true}});
  }
  return changes;
}

void apply_changes(WrittenPipeline& pipeline, std::vector<WrittenEntry> changes, int layer, Diagnostics& diagnostics) {
  int first = 0;
  if (!changes.empty())
    first = std::min_element(changes.begin(), changes.end(), [](const WrittenEntry& a, const WrittenEntry& b) {
              return a.value.layer < b.value.layer;
            })->value.layer;
  for (WrittenEntry& one : changes) {
    one.value.layer += layer - first;
    if (!one.value.inputs) one.value.inputs = pipeline.inputs;
  }
  Changer(pipeline, diagnostics).apply(changes);
}

void add_settings(const std::filesystem::path& file, PipelineArguments& arguments, Diagnostics& diagnostics) {
  static const std::vector<std::string> kKeys{"inputs", "set"};
  const int layer = arguments.overrides.empty() ? 0 : arguments.overrides.back().layer + 1;
  const auto text = read_source(file, "the file of settings", diagnostics);
  if (!text) return;
  StrictYaml yaml(file.string(), diagnostics);
  const std::size_t before = diagnostics.size();
  const YAML::Node root = yaml.parse(*text);
  if (diagnostics.size() > before) return;
  for (const YamlEntry& section : yaml.map(root, {file.string(), 1, 1}, "the file of settings", &kKeys))
    for (const YamlEntry& entry : yaml.map(section.value, section.place, in_quotes(section.key))) {
      if (section.key == "set")
        arguments.overrides.push_back({entry.key, text_to_give(entry.value), entry.place, layer});
      else if (const auto value = yaml.text(entry.value, entry.place, in_quotes(entry.key)))
        arguments.inputs.push_back({entry.key, *value, entry.place});
    }
}

}  // namespace marrow
