// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/catalogue.hpp"
#include "marrow/runtime/diagnostics.hpp"

namespace marrow {

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

struct PipelineNode {
  std::string id;
  Place place;
  NodeInfo info;
  Apart apart = Apart::no;           ///< as its kind says
  bool may_fail = false;             ///< if it fails, its outputs are absent, and the run goes on
  std::vector<OptionValue> options;  ///< in the order of info.options
  std::vector<Wire> wires;
  std::vector<std::string> mapped_axes;  ///< the node is called for each item along these, outermost first
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
  std::vector<std::string> notes;  ///< remarks for people that are not faults

  /// The axes of an output of a node, outermost first.
  std::vector<std::string> axes_of(const Reference& source) const;
  /// For each node, whether it must be run for the outputs. given(id) says whether the outputs of a node are already
  /// known.
  std::vector<bool> needed(const std::function<bool(const std::string&)>& given = {}) const;
};

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

/// The pipeline as YAML, with the values of all options. Reading it gives the same pipeline.
std::string resolved_yaml(const Pipeline& pipeline);

}  // namespace marrow
