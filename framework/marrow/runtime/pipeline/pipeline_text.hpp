// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
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

struct DeclaredInputs;

/// A value as written.
struct WrittenValue {
  Place place;
  WrittenYaml value;
  std::filesystem::path folder;                       ///< where relative paths in the value start
  std::shared_ptr<const DeclaredInputs> inputs = {};  ///< what $name stands for in it; null: it has no names
  int layer = 0;             ///< counts the files that a pipeline is read from, and what changes it after them
  bool is_override = false;  ///< whether its parts have no places of their own
};

/// A value and the name that it is given to. As a change of a pipeline, the name is node.option, node.uses and the
/// like.
struct WrittenEntry {
  std::string name;
  WrittenValue value;
};

/// One of a pipeline's inputs. It has a text as its value, or data: then the pipeline is a part of others.
struct DeclaredInput {
  std::string name;
  Place place;
  std::string type = "text";
  std::string help = {};
  std::optional<WrittenValue> default_value = {};
  std::optional<TypeInfo> data = {};  ///< the type of its data, else nothing
  std::string over = {};              ///< the axis of its data; empty: one item
  bool is_optional = false;           ///< whether a user of the part may leave it out
};

struct DeclaredInputs {
  std::vector<DeclaredInput> all;
  std::map<std::string, std::string> values;  ///< as texts
  std::vector<std::string> missing;           ///< inputs with a text that have no value and no default
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
};

struct WrittenNode {
  std::string id;
  Place place = {};
  std::string uses = {};  ///< kind.name, or the name of a pipeline file
  Place uses_place = {};
  std::filesystem::path uses_folder = {};  ///< where the name of a file starts
  int uses_layer = 0;
  bool may_fail = false;
  std::vector<WrittenEntry> options = {}, wires = {};
  std::vector<WrittenEntry> changes = {};  ///< of the pipeline that the node uses or repeats
  std::optional<WrittenRepetition> repetition = {};
  std::optional<PortInfo> stands_for = {};  ///< an input of a part that is read alone: the node makes nothing
};

/// A pipeline file as written, with the files that it extends, the overrides and the parts put in. No name of a node
/// in it has been looked up yet.
struct WrittenPipeline {
  std::string name, help;
  std::filesystem::path file;
  std::vector<std::filesystem::path> files;  ///< all that were read
  std::shared_ptr<DeclaredInputs> inputs = std::make_shared<DeclaredInputs>();
  std::set<std::string> inputs_of_parts;  ///< names of inputs that parts are given
  std::vector<WrittenNode> nodes;
  std::vector<WrittenEntry> outputs;
  bool only_inside = false;
  std::vector<std::string> notes;
};

/// A reader for the parts of a value, which reports faults at their places.
inline StrictYaml yaml_of(const WrittenValue& value, Diagnostics& diagnostics) {
  return value.is_override ? StrictYaml(value.place, diagnostics) : StrictYaml(value.place.file, diagnostics);
}

/// Parts in parts multiply, so a few small files could fill the memory.
inline constexpr std::size_t kMostNodesOfParts = 20'000;

/// What a pipeline file is read for.
struct PipelineReading {
  std::vector<InputValue> inputs;
  std::vector<WrittenEntry> changes;          ///< overrides
  std::vector<std::filesystem::path> inside;  ///< the files whose parts or bodies are read, outermost first
  enum class Use { alone, check, part, body } use = Use::alone;
  std::shared_ptr<std::size_t> nodes_left = std::make_shared<std::size_t>(kMostNodesOfParts);  ///< of parts
};

/// The overrides of a program as changes of a pipeline.
std::vector<WrittenEntry> changes_of(const std::vector<Override>& overrides, Diagnostics& diagnostics);

WrittenPipeline read_written_pipeline(const std::filesystem::path& file, const PipelineReading& reading,
                                      const Catalogue& catalogue, Diagnostics& diagnostics);
/// Reads the body of node `name` from the pipeline's own file.
WrittenPipeline read_written_body(const std::filesystem::path& file, const std::string& name, const YAML::Node& body,
                                  const PipelineReading& reading, const Catalogue& catalogue, Diagnostics& diagnostics);

/// Reports circles of nodes that wait for each other, each with its own nodes only. All written wires count: a wire
/// that a node does not use is used as soon as another node of the kind takes its place. Only the nodes' ids must be
/// known, so circles are found beside all other faults. Of two circles that share a node, the second is reported when
/// the first is mended.
void check_circles(const WrittenPipeline& written, Diagnostics& diagnostics);

}  // namespace marrow
