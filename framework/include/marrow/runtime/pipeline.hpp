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

/// node, node.output, node.item or node.output.item, as written in a pipeline.
struct Reference {
  std::string text;
  Place place;
  int node = -1;                   ///< index into Pipeline::nodes
  int output = -1;                 ///< index into the node's outputs
  std::vector<std::string> items;  ///< picks along the axes, outermost first
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
  std::vector<PipelineNode> nodes;  ///< in an order in which sources come before users
  std::vector<PipelineOutput> outputs;
  std::vector<std::string> notes;  ///< things worth knowing that are no faults

  /// The axes of an output of a node, outermost first.
  std::vector<std::string> axes_of(const Reference& source) const;
  /// The nodes that must be run for the outputs; `given(id)` tells which ones are known already.
  std::vector<bool> needed(const std::function<bool(const std::string&)>& given = {}) const;
};

/// A value of one of the pipeline's inputs.
struct InputValue {
  std::string name, value;
  Place place =
      {};  ///< in the file that it was written in, whose folder relative paths start from; none: the command line
};

/// node.option=value, node.uses=kind.name or node.in.port=reference.
struct Override {
  std::string key, value;
  Place place = {};  ///< as that of an input's value
};

struct PipelineArguments {
  std::vector<InputValue> inputs;
  std::vector<Override> overrides;
};

/// Reads and checks a pipeline. All faults go to `diagnostics`; the result may be used only when there are none.
/// `inputs_required` is false for `check`, where values of inputs without a default may be left out.
Pipeline read_pipeline(const std::filesystem::path& file, const PipelineArguments& arguments,
                       const Catalogue& catalogue, Diagnostics& diagnostics, bool inputs_required = true);

/// The pipeline as YAML with everything explicit; reading it gives the same pipeline.
std::string resolved_yaml(const Pipeline& pipeline);

}  // namespace marrow
