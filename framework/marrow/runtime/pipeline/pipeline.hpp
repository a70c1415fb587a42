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
#include "marrow/base/export.hpp"
#include "marrow/runtime/plugins/catalogue.hpp"

namespace MARROW_EXPORT marrow {

/// A reference as written in a pipeline: node, node.output, node.item or node.output.item.
struct Reference {
  std::string text;
  Place place;
  int node = -1;                   ///< index into Pipeline::nodes
  int output = -1;                 ///< index into the node's outputs
  std::vector<std::string> items;  ///< the items that it picks along the axes, outermost first
};

/// What one input port is wired to: one reference, or several that make a list.
struct Wire {
  int port = -1;  ///< index into the node's inputs
  std::vector<Reference> sources;
  bool is_list_literal = false;
};

struct Repetition;

struct PipelineNode {
  std::string id;
  Place place;
  NodeInfo info;
  Apart apart = Apart::no;           ///< as its kind says
  bool may_fail = false;             ///< if it fails, its outputs are absent, and the run goes on
  std::vector<OptionValue> options;  ///< in the order of info.options
  std::vector<Wire> wires;
  std::vector<std::string> mapped_axes;  ///< the node is called for each item along these, outermost first
  /// If the node has a body, `info` is made from it: its name is "repeat", its inputs are what the body is given.
  std::shared_ptr<const Repetition> repetition;
};

struct PipelineOutput {
  std::string name;
  Reference source;
};

/// A pipeline that was read, checked and resolved: every node is known, every option has a value, every wire fits.
struct Pipeline {
  std::string name;
  std::string help;
  std::filesystem::path file;
  std::vector<PipelineNode> nodes;  ///< sorted so that sources come before users
  std::vector<PipelineOutput> outputs;
  bool only_inside = false;        ///< it runs only inside the program, so its outputs may be functions
  std::vector<std::string> notes;  ///< remarks for people that are not faults

  /// The axes of a value that a reference names, outermost first.
  std::vector<std::string> axes_of(const Reference& source) const;
  /// For each node, whether it must be run for the outputs. given(id) says whether the outputs of a node are already
  /// known.
  std::vector<bool> needed(const std::function<bool(const std::string&)>& given = {}) const;
};

/// A body: a pipeline that a node runs again and again, one pass after the other. A pass runs for each item of an axis,
/// or until a stop rule holds. Outputs of the node: for each output NAME of the body, NAME (the list over all passes)
/// and last_NAME (that of the last pass that did not fail).
struct Repetition {
  /// What is given to the body in the place of an output of one of its nodes.
  struct Given {
    std::string name;               ///< node or node.output of the body; the name of the port
    Reference target;               ///< the same in `alone`
    std::string node;               ///< the node of `body` that stands for it
    std::vector<std::string> axes;  ///< that a pass is given, outermost first
    int carried = -1;               ///< the output of the body that takes its place in the next pass; -1: none
  };
  Pipeline alone;  ///< the body as it was read, a pipeline that can be run alone
  /// The body as it is run in a pass: for each value that is given it has a node that is never called.
  Pipeline body;
  /// The same for the first pass. It makes those carried values itself that the node's inputs do not give.
  Pipeline first;
  std::vector<Given> given;  ///< in the order of the node's inputs; then those that are only carried
  std::string axis;          ///< of the passes: that of the items; of a loop "pass", or "once" if it has one pass only
  bool is_loop = false;      ///< not over the items of an axis; passes are named 1, 2, 3...
  int at_most = 0;           ///< passes; 0: as many as there are items
  int until = -1;            ///< the output of the body, of type stop, that ends the passes; -1: none
  bool goes_on = false;      ///< after a pass that failed; what it did not make is absent then
};

/// The nodes that a run may call: those that the outputs need, and of nodes with a body, those of the body.
std::vector<const PipelineNode*> called_nodes(const Pipeline& pipeline);

/// A value of one of the pipeline's inputs.
struct InputValue {
  std::string name, value;
  /// Where the value is written. Relative paths start at the folder of that file. No file means the command line.
  Place place = {};
};

/// A change of the pipeline: node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference.
struct Override {
  std::string key, value;
  Place place = {};  ///< as InputValue::place
};

struct PipelineArguments {
  std::vector<InputValue> inputs;
  std::vector<Override> overrides;
};

/// Reads and checks a pipeline. All faults go to `diagnostics`; the result may be used only if there are none.
/// `inputs_required` is false for `marrow check`: inputs without a default may then have no value.
Pipeline read_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments,
                       const Catalogue& catalogue, Diagnostics& diagnostics, bool inputs_required = true);

/// The same, for a caller that tries many changes of one file and wants to know what is wrong with each, but not what
/// to do about it: no hint names nodes that would fit, because finding them means to check the pipeline with each other
/// node. Inputs without a default may have no value.
Pipeline try_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments, const Catalogue& catalogue,
                      Diagnostics& diagnostics);

/// The pipeline as YAML, with the values of all options. Reading it gives the same pipeline.
std::string resolved_yaml(const Pipeline& pipeline);

/// Adds a fault for each output of the pipeline that could not be written: no library has a writer for its type.
/// Functions are no faults in a pipeline that only runs inside the program.
void check_writers(const Pipeline& pipeline, const Catalogue& catalogue, Diagnostics& diagnostics);

}  // namespace marrow
