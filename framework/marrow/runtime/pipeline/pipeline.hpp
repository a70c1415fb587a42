// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/diagnostics.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace MARROW_EXPORT marrow {

/// A reference as written in a pipeline: node, node.output, node.item or node.output.item.
struct Reference {
  std::string text;
  Place place;
  int node = -1;                   ///< index into Pipeline::nodes
  int output = -1;                 ///< index into the node's outputs
  std::vector<std::string> items;  ///< the items that it picks along the axes, outermost first

  bool has_same_output(const Reference& other) const { return node == other.node && output == other.output; }
};

/// What one input port is wired to.
struct Wire {
  int port = -1;  ///< index into the node's inputs
  std::vector<Reference> sources;
  bool is_list_literal = false;  ///< written as a list of references: the port gets the list of their values
};

struct Repetition;

struct PipelineNode {
  std::string id;
  Place place;
  Place uses_place = {};  ///< where what it uses is written; another one than `place` if a change says it
  NodeInfo info;
  Apart apart = Apart::no;           ///< as its kind declares
  bool may_fail = false;             ///< if it fails, its outputs are absent, and the run continues
  std::vector<OptionValue> options;  ///< in the order of info.options
  std::vector<Place> option_places;  ///< where each value is written; no file: it is the default
  std::vector<Wire> wires;
  std::vector<std::string> mapped_axes;  ///< the node is called for each item along these, outermost first
  /// For a node with a body, else null. `info` is then made from the body: its name is "repeat", and its inputs are the
  /// values that the body is given.
  std::shared_ptr<const Repetition> repetition;
  bool stands_for_input = false;  ///< of a part that is read alone; only checked, never called

  const PortInfo& input_of(const Wire& wire) const { return info.inputs[std::size_t(wire.port)]; }
};

struct PipelineOutput {
  std::string name;
  Reference source;
};

/// An input as a pipeline declares it.
struct PipelineInput {
  std::string name;
  std::string type;  ///< path, text, number, integer or boolean, or the id of a type of data
  std::string help;
  bool has_default = false;
  std::string default_text = {};  ///< a path is whole
  bool is_data = false;           ///< whether only a pipeline that uses this one as a node can give it
  std::string over = {};          ///< the axis of its data; empty: one item
  bool is_optional = false;       ///< whether its data may be left out
};

/// A pipeline that was read and checked: every node is known, every option has a value, every wire fits.
struct Pipeline {
  std::string name;
  std::string help;
  std::filesystem::path file;
  std::vector<std::filesystem::path> files;  ///< all that it was read from: the file, what it extends, parts, bodies
  std::vector<PipelineNode> nodes;           ///< sorted so that sources come before users
  std::vector<PipelineOutput> outputs;
  std::vector<PipelineInput> inputs;  ///< in the order of the file
  bool only_inside = false;           ///< only the program itself runs it, so its outputs may be functions
  std::vector<std::string> notes;     ///< remarks for people that are not faults

  /// The node that a reference names, and its output. The reference must be resolved.
  const PipelineNode& node_of(const Reference& source) const { return nodes[std::size_t(source.node)]; }
  const PortInfo& output_of(const Reference& source) const {
    return node_of(source).info.outputs[std::size_t(source.output)];
  }
  /// The axes of the value that a reference names, outermost first.
  std::vector<std::string> axes_of(const Reference& source) const;
  /// For each node, whether it must run to make the outputs. given(id) says whether the outputs of a node are known
  /// already.
  std::vector<bool> needed(const std::function<bool(const std::string&)>& given = {}) const;
};

/// The body of a node: a pipeline that the node runs again and again, one pass after the other. There is one pass for
/// each item of an axis, or the passes end when a stop rule holds. For each output NAME of the body, the node has the
/// outputs NAME (the list over all passes) and last_NAME (from the last pass that did not fail).
struct Repetition {
  /// A value that the body is given. It replaces an output of one of the body's nodes.
  struct Given {
    std::string name;               ///< node or node.output of the body; also the name of the node's input
    Reference target;               ///< the replaced output, in `alone`
    std::string node;               ///< the id of the node of `body` that holds the value
    std::vector<std::string> axes;  ///< axes of the value in one pass, outermost first
    int carried = -1;               ///< index of the body's output that replaces the value in the next pass; -1: none
  };
  Pipeline alone;  ///< the body as it was read; it could run alone
  /// The body as a pass runs it. Each given value has a node that is never called.
  Pipeline body;
  /// The same for the first pass. It computes the carried values that the node's inputs do not give.
  Pipeline first;
  std::vector<Given> given;  ///< in the order of the node's inputs; then the values that are only carried
  std::string axis;          ///< of the list over all passes; for a loop "pass", or "once" if it has only one pass
  bool is_loop = false;      ///< whether the passes do not follow the items of an axis; they are named 1, 2, 3...
  int at_most = 0;           ///< the most passes; 0: one for each item
  int until = -1;            ///< index of the body's output, of type stop, that ends the passes; -1: none
  bool goes_on = false;      ///< whether a failed pass is followed by the next; its missing outputs are then absent

  /// Whether the node of `body` or `first` with this id holds a given value.
  bool is_given(const std::string& id) const;
};

/// The nodes that a run may call: those that the outputs need. A node with a body is replaced by the nodes of its body.
std::vector<const PipelineNode*> called_nodes(const Pipeline& pipeline);

/// The value of one of the pipeline's inputs.
struct InputValue {
  std::string name, value;
  /// Where the value is written. Relative paths start at the folder of that file. An empty file means the command line.
  Place place = {};
};

/// A change of the pipeline: node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference. For
/// a node of a part, PART.node.option=value and so on.
struct Override {
  std::string key, value;
  Place place = {};  ///< as InputValue::place
  int layer = 0;  ///< where uses= replaces a node, the options that overrides of lower layers gave it no longer count
};

struct PipelineArguments {
  std::vector<InputValue> inputs;
  std::vector<Override> overrides;
};

/// Reads and checks a pipeline. All faults go to `diagnostics`. The result may be used only if there are none. If
/// `inputs_required` is false, as in `marrow check`, an input without a default needs no value. The file "-" is the
/// standard input, whose relative paths start at the working folder.
Pipeline read_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments,
                       const Catalogue& catalogue, Diagnostics& diagnostics, bool inputs_required = true);

/// The same, for a caller that tries many changes of one file. Hints do not name other nodes that would fit, because to
/// find them the pipeline is checked with each node. An input without a default needs no value.
Pipeline try_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                      Diagnostics& diagnostics);

/// The pipeline as YAML, with the values of all options. Reading it gives the same pipeline.
std::string resolved_yaml(const Pipeline& pipeline);
/// The same, with comments that say in which file and line each node is written, and each value that is written
/// elsewhere. Files are relative to the pipeline's folder.
std::string resolved_yaml_with_places(const Pipeline& pipeline);

/// The place as "femur.yaml:17", relative to the folder of `file` or to the one above it, so that the text is the same
/// wherever that lies; elsewhere the whole path. The change itself for a value of the command line. Empty for a
/// default.
std::string place_text(const Place& place, const std::filesystem::path& file);

/// Why a value of this type cannot become a file.
std::string no_writer(const TypeInfo& type);

/// Adds a fault for each output of the pipeline whose type no library can write. A pipeline that only the program runs
/// may have any outputs.
void check_writers(const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& diagnostics);

/// Adds what a file of settings says, with the keys `inputs` and `set`, to the arguments of a pipeline. Its overrides
/// are a layer above those that are there.
void add_settings(const std::filesystem::path& file, PipelineArguments& arguments, Diagnostics& diagnostics);

/// A node that may replace another node of a pipeline.
struct Fit {
  std::string node;                  ///< kind.name
  std::vector<std::string> missing;  ///< what must be wired or given so that the node fits, one line each
  std::vector<std::string> faults;   ///< why it does not fit
};

/// The nodes that could replace node `id`, with the default values of their options: all nodes of the same kind, even
/// if they do not fit, and then the nodes of other kinds that fit. If the pipeline itself has faults or `id` is
/// unknown, this goes to `diagnostics`, and the result is empty.
std::vector<Fit> nodes_in_place_of(const std::string& id, const std::filesystem::path& file,
                                   const PipelineArguments& arguments, const Catalogue& catalogue,
                                   Diagnostics& diagnostics);

// Which poses of a pipeline get a verdict. A pose without one must not look like a judged pose.

/// Keeps only the outputs of these names, and the verdicts on all poses that are made for them. So a part of a pipeline
/// tells as much about its poses as the whole. Throws Error if the pipeline has no output of a name.
void keep_outputs(Pipeline& pipeline, const std::vector<std::string>& names);

/// A sentence for each output that is a pose without a verdict. A verdict on an earlier pose also counts, if the output
/// was made from that pose and no node in between has a cost. So new deviations keep the verdict; a new search does
/// not.
std::vector<std::string> notes_on_poses(const Pipeline& pipeline);

/// A pipeline of one node, and the values of its inputs. run_pipeline() runs it with `given` as RunSettings::given.
struct OneNode {
  Pipeline pipeline;  ///< its last node is called; its outputs have the names of the node's outputs
  std::map<std::string, std::vector<Value>> given;
};

/// Makes a pipeline that calls the node `name`, for a program that has the node's inputs in memory. Each of `inputs`
/// has the name of a port. If a port takes one item and gets a list, the node is called for each item, as in any
/// pipeline. Each of `options` has a name and its value as in given_value(). Relative paths start at the working
/// folder. All faults go to `diagnostics`. The result may be used only if there are none. The place of a fault has no
/// line: Place::file is "kind.name(port or option)".
OneNode pipeline_of_node(const std::string& name, const std::vector<std::pair<std::string, Value>>& inputs,
                         const std::vector<std::pair<std::string, std::string>>& options, const Catalogue& catalogue,
                         Diagnostics& diagnostics);

}  // namespace marrow
