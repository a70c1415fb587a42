// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/strict_yaml.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace marrow {

/// A YAML node that becomes the other one when it is assigned. YAML::Node would change what both of them share with
/// others: an alias elsewhere in the file, or a neighbour that moves up in a vector.
class WrittenYaml : public YAML::Node {
 public:
  WrittenYaml() = default;
  WrittenYaml(const YAML::Node& node) : YAML::Node(node) {}
  WrittenYaml(const WrittenYaml&) = default;
  WrittenYaml& operator=(const WrittenYaml& other) {
    reset(other);
    return *this;
  }
};

/// A value as written.
struct WrittenValue {
  Place place;
  WrittenYaml value;
  std::filesystem::path folder;  ///< where relative paths in the value start
  bool is_override = false;      ///< whether it comes from an override; its parts then have no places
};

/// A value and the name that it is given to.
struct WrittenEntry {
  std::string name;
  WrittenValue value;
};

/// The body of a node, as written.
struct WrittenRepetition {
  WrittenValue body;  ///< the name of a file, or the body itself
  std::string over;   ///< empty for a loop
  Place over_place;
  std::vector<WrittenEntry> carry;
  std::string until;
  Place until_place;
  int at_most = 0;
  bool goes_on = false;
  std::vector<Override> overrides;  ///< changes of the body
};

struct WrittenNode {
  std::string id;
  Place place;
  std::string uses;
  Place uses_place;
  bool may_fail = false;
  std::vector<WrittenEntry> options, wires;
  std::optional<WrittenRepetition> repetition;
};

/// A pipeline file as written, with the overrides applied. No name in it has been looked up yet.
struct WrittenPipeline {
  std::string name, help;
  std::filesystem::path file;
  std::map<std::string, std::string> inputs;  ///< values, as texts
  std::vector<std::string> missing_inputs;    ///< declared inputs without a value and without a default
  std::map<std::string, Place> input_places;  ///< where each is declared
  std::vector<WrittenNode> nodes;
  std::vector<WrittenEntry> outputs;
  bool only_inside = false;
  std::vector<std::string> notes;
};

/// A reader for the parts of a value, which reports faults at their places.
inline StrictYaml yaml_of(const WrittenValue& value, Diagnostics& diagnostics) {
  return value.is_override ? StrictYaml(value.place, diagnostics) : StrictYaml(value.place.file, diagnostics);
}

WrittenPipeline read_written_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments,
                                      Diagnostics& diagnostics, bool inputs_required);
/// Reads the body of node `name` from the pipeline's own file.
WrittenPipeline read_written_body(const std::filesystem::path& file, const std::string& name, const YAML::Node& body,
                                  const PipelineArguments& arguments, Diagnostics& diagnostics);

/// Reports circles of nodes that wait for each other, each with its own nodes only. All written wires count: a wire
/// that a node does not use is used as soon as another node of the kind takes its place. Only the nodes' ids must be
/// known, so circles are found beside all other faults. Of two circles that share a node, the second is reported when
/// the first is mended.
void check_circles(const WrittenPipeline& written, Diagnostics& diagnostics);

}  // namespace marrow
