// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/strict_yaml.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// A value as written, with its place and with the folder at which relative paths in it start.
struct WrittenValue {
  Place place;
  YAML::Node value;
  std::filesystem::path folder;
  bool is_override = false;  ///< from an override: the parts of its text have no places of their own
};

/// The body of a node, as written.
struct WrittenRepetition {
  WrittenValue body;  ///< the name of a file, or the body itself
  std::string over;   ///< empty for a loop
  Place over_place;
  std::vector<std::pair<std::string, WrittenValue>> carry;
  std::string until;
  Place until_place;
  int at_most = 0;
  Place at_most_place;
  bool goes_on = false;
  std::vector<Override> overrides;  ///< of the body
};

struct WrittenNode {
  std::string id;
  Place place;
  std::string uses;
  Place uses_place;
  bool may_fail = false;
  std::vector<std::pair<std::string, WrittenValue>> options;
  std::vector<std::pair<std::string, WrittenValue>> wires;
  std::optional<WrittenRepetition> repetition;
};

/// A pipeline file as written, with the overrides applied. No name in it has been looked up yet.
struct WrittenPipeline {
  std::string name, help;
  std::filesystem::path file;
  std::map<std::string, std::string> inputs;  ///< values, as texts
  std::vector<std::string> missing_inputs;    ///< inputs that are declared but have neither a value nor a default
  std::map<std::string, Place> input_places;  ///< where each is declared
  std::vector<WrittenNode> nodes;
  std::vector<std::pair<std::string, WrittenValue>> outputs;
  bool only_inside = false;
  std::vector<std::string> notes;
};

/// A reader for the parts of a value. It reports faults at their places.
inline StrictYaml yaml_of(const WrittenValue& value, Diagnostics& diagnostics) {
  return value.is_override ? StrictYaml(value.place, diagnostics) : StrictYaml(value.place.file, diagnostics);
}

/// Whether a node's options or wires give that name.
inline bool is_written(const std::vector<std::pair<std::string, WrittenValue>>& list, const std::string& name) {
  return std::any_of(list.begin(), list.end(), [&](const auto& item) { return item.first == name; });
}

WrittenPipeline read_written_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments,
                                      Diagnostics& diagnostics, bool inputs_required);
/// The body of a node that is written in the file of the pipeline itself. `name`: of the node.
WrittenPipeline read_written_body(const std::filesystem::path& file, const std::string& name, const YAML::Node& body,
                                  const PipelineArguments& arguments, Diagnostics& diagnostics);

}  // namespace marrow
