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

/// One of the files that a pipeline is read from, while it is read.
struct PipelineLayer {
  StrictYaml& yaml;
  Diagnostics& diagnostics;
  std::filesystem::path folder;  ///< where relative paths start
  std::shared_ptr<const DeclaredInputs> inputs;
  int number = 0;

  WrittenValue value_of(const YamlEntry& entry) const { return {entry.place, entry.value, folder, inputs, number}; }
};

/// Puts the entries of a map over those of the files below. `null` removes an entry of these.
void put_over(std::vector<WrittenEntry>& entries, const YamlEntry& map, const std::string& what,
              const PipelineLayer& layer);

/// Puts what a file says of a node over what the files below say.
void put_node_over(WrittenPipeline& pipeline, const YamlEntry& entry, const PipelineLayer& layer);

/// Sets what the node uses. Options of the files below were written for the replaced node, so another node must not get
/// them. Returns whether there were some.
bool set_uses(WrittenNode& node, const std::string& uses, const Place& place, const std::filesystem::path& folder,
              int layer);

/// Sets how many passes there are. `key`: at_most, until or if_pass_fails.
void set_passes(WrittenNode& node, const std::string& key, const YAML::Node& value, const Place& place,
                StrictYaml& yaml);

/// The text "'may_fail' of node 'id'".
std::string may_fail_of(const std::string& node);

/// Whether a node uses a pipeline file, not a node of a plugin.
bool is_part(const std::string& uses);

/// Puts what a file declares under `inputs` over what the files below declare.
void put_inputs_over(DeclaredInputs& inputs, const YamlEntry& section, const PipelineLayer& layer,
                     const Catalogue& catalogue);

/// Gives the inputs their values: given ones, else the defaults. Checks them.
void set_inputs(DeclaredInputs& inputs, const PipelineReading& reading, Diagnostics& diagnostics);

/// What the file declares, for those who use the pipeline.
std::vector<PipelineInput> listed_inputs(const DeclaredInputs& inputs);

/// Where a relative path in a value of an input or in an override starts: the folder of the file that it is written in,
/// else the working folder.
std::filesystem::path folder_of(const Place& written);

/// The entries of `set` in a file.
std::vector<WrittenEntry> changes_in(const YamlEntry& section, const PipelineLayer& layer);

/// Changes the pipeline. `layer`: the number of the changes' layer; those of a later layer of their own come after it.
/// Options that an override makes useless are worth a note.
void apply_changes(WrittenPipeline& pipeline, std::vector<WrittenEntry> changes, int layer, Diagnostics& diagnostics);

/// Replaces each node that uses a pipeline file by the nodes of that file, called NODE/ITS NODE. Its inputs of data are
/// replaced by what the node is wired to, and what names the node by what makes its outputs. If the pipeline is itself
/// a part that is checked alone, nodes stand for its inputs.
void put_parts_in(WrittenPipeline& pipeline, const PipelineReading& reading, const Catalogue& catalogue,
                  Diagnostics& diagnostics);

}  // namespace marrow
