// SPDX-License-Identifier: Apache-2.0
// One node of a pipeline file, as written.
#include <algorithm>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"
#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {
namespace {

std::string part_of(const YamlEntry& part, const WrittenNode& node) {
  return in_quotes(part.key) + " of node " + in_quotes(node.id);
}

void check_name(const std::string& id, const Place& place, StrictYaml& yaml) {
  if (id.find('.') != std::string::npos)
    yaml.fault(place, "the node's name " + in_quotes(id) + " has a dot", "dots are for outputs, as in case.views");
  if (id.empty()) yaml.fault(place, "a node has no name", "write it as  name: {uses: kind.name}");
}

void read_repetition(WrittenNode& node, const YamlEntry& part, const PipelineLayer& layer) {
  if (!node.repetition) node.repetition.emplace();
  WrittenRepetition& repetition = *node.repetition;
  if (part.key == "repeat") {
    repetition.body = layer.value_of({part.key, layer.yaml.place(part.value), part.value});
  } else if (part.key == "over") {
    repetition.over_place = part.place;
    repetition.over = layer.yaml.text(part.value, part.place, part_of(part, node)).value_or("");
  } else if (part.key == "carry") {
    put_over(repetition.carry, part, part_of(part, node), layer);
  } else {
    set_passes(node, part.key, part.value, part.place, layer.yaml);
  }
}

void check_repetition(const WrittenNode& node, StrictYaml& yaml) {
  const WrittenRepetition& repetition = *node.repetition;
  const std::string who = "node " + in_quotes(node.id);
  if (!node.uses.empty())
    yaml.fault(node.place, who + " has both 'uses' and a body", "leave out one of  uses:  and  repeat:");
  else if (!repetition.body.value.IsDefined() || repetition.body.value.IsNull())
    yaml.fault(node.place, who + " does not say what it repeats", "add  repeat: FILE  with the body, a pipeline file");
  else if (repetition.over.empty() && repetition.at_most == 0 && !repetition.over_place.line)
    yaml.fault(node.place, who + " may never end: it goes over no axis and has no limit of passes",
               "add  over: AXIS,  or  at_most: PASSES");
}

void read_changes(WrittenNode& node, const YamlEntry& part, const PipelineLayer& layer) {
  for (const YamlEntry& change : layer.yaml.map(part.value, part.place, part_of(part, node)))
    node.changes.push_back({change.key, layer.value_of(change)});
}

/// A file says anew what a node is: a body instead of a node, or the reverse.
void replace_what_it_is(WrittenNode& node, const std::vector<YamlEntry>& parts, int layer) {
  const auto has = [&](const char* key) {
    return std::any_of(parts.begin(), parts.end(), [&](const YamlEntry& part) { return part.key == key; });
  };
  const bool is_of_below = node.repetition ? node.repetition->body.layer < layer : node.uses_layer < layer;
  if (!is_of_below) return;
  if (node.repetition && has("uses")) node.repetition.reset();
  if (!node.repetition && has("repeat")) {
    node.uses.clear();
    node.options.clear();
  }
}

}  // namespace

std::string may_fail_of(const std::string& node) { return "'may_fail' of node " + in_quotes(node); }

bool is_part(const std::string& uses) { return uses.ends_with(".yaml") || uses.ends_with(".yml"); }

void put_over(std::vector<WrittenEntry>& entries, const YamlEntry& map, const std::string& what,
              const PipelineLayer& layer) {
  for (const YamlEntry& item : layer.yaml.map(map.value, map.place, what)) {
    const auto old =
        std::find_if(entries.begin(), entries.end(), [&](const WrittenEntry& one) { return one.name == item.key; });
    if (old == entries.end())
      entries.push_back({item.key, layer.value_of(item)});
    else if (item.value.IsNull())
      entries.erase(old);
    else
      old->value = layer.value_of(item);
  }
}

bool set_uses(WrittenNode& node, const std::string& uses, const Place& place, const std::filesystem::path& folder,
              int layer) {
  const auto is_of_below = [&](const WrittenEntry& one) { return one.value.layer < layer; };
  const bool is_other = uses != node.uses || (is_part(uses) && folder != node.uses_folder);
  const bool drops = is_other && std::erase_if(node.options, is_of_below) > 0;
  if (is_other) std::erase_if(node.changes, is_of_below);
  node.uses = uses;
  node.uses_place = place;
  node.uses_folder = folder;
  node.uses_layer = layer;
  return drops;
}

void set_passes(WrittenNode& node, const std::string& key, const YAML::Node& value, const Place& place,
                StrictYaml& yaml) {
  constexpr std::int64_t kMostPasses = 1'000'000;
  static const std::vector<std::string> kChoices{"end", "go_on"};
  WrittenRepetition& repetition = *node.repetition;
  const std::string what = in_quotes(key) + " of node " + in_quotes(node.id);
  if (key == "at_most") {
    const auto passes = yaml.integer(value, place, what);
    if (!passes) return;
    if (*passes >= 1 && *passes <= kMostPasses)
      repetition.at_most = int(*passes);
    else
      yaml.fault(place,
                 formatted("'at_most' is {}, but must be a number of passes from 1 to {}", *passes, kMostPasses));
  } else if (key == "until") {
    repetition.until_place = place;
    repetition.until = yaml.text(value, place, what).value_or("");
  } else {
    const auto choice = yaml.text(value, place, what);
    if (choice && !contains(kChoices, *choice))
      yaml.fault(place, "'if_pass_fails' is " + in_quotes(*choice) + ", but must be end or go_on",
                 suggestion(*choice, kChoices));
    repetition.goes_on = choice == "go_on";
  }
}

void put_node_over(WrittenPipeline& pipeline, const YamlEntry& entry, const PipelineLayer& layer) {
  static const std::vector<std::string> kKeys{"uses", "with",  "in",      "may_fail", "set",          "repeat",
                                              "over", "carry", "at_most", "until",    "if_pass_fails"};
  const auto old = std::find_if(pipeline.nodes.begin(), pipeline.nodes.end(),
                                [&](const WrittenNode& one) { return one.id == entry.key; });
  const bool is_new = old == pipeline.nodes.end();
  if (!is_new && entry.value.IsNull()) {
    pipeline.nodes.erase(old);
    return;
  }
  WrittenNode node = is_new ? WrittenNode() : *old;
  node.id = entry.key;
  node.place = entry.place;
  if (is_new) node.uses_place = entry.place;
  check_name(node.id, node.place, layer.yaml);
  const std::vector<YamlEntry> parts = layer.yaml.map(entry.value, entry.place, "node " + in_quotes(entry.key), &kKeys);
  replace_what_it_is(node, parts, layer.number);
  for (const YamlEntry& part : parts)
    if (part.key == "uses")
      set_uses(node, layer.yaml.text(part.value, part.place, "uses").value_or(""), layer.yaml.place(part.value),
               layer.folder, layer.number);
  for (const YamlEntry& part : parts) {
    if (part.key == "uses") continue;
    if (part.key == "may_fail")
      node.may_fail = layer.yaml.boolean(part.value, part.place, may_fail_of(node.id)).value_or(false);
    else if (part.key == "set")
      read_changes(node, part, layer);
    else if (part.key == "with" || part.key == "in")
      put_over(part.key == "with" ? node.options : node.wires, part, part_of(part, node), layer);
    else
      read_repetition(node, part, layer);
  }
  const bool says_uses = std::any_of(parts.begin(), parts.end(), [](const YamlEntry& part) {
    return part.key == "uses" && (!part.value.IsScalar() || !part.value.Scalar().empty());
  });
  if (node.repetition)
    check_repetition(node, layer.yaml);
  else if (node.uses.empty() && !says_uses && entry.value.IsMap())
    layer.yaml.fault(entry.place, "node " + in_quotes(entry.key) + " does not say what it uses",
                     "add  uses: kind.name");
  if (is_new)
    pipeline.nodes.push_back(std::move(node));
  else
    *old = std::move(node);
}

}  // namespace marrow
