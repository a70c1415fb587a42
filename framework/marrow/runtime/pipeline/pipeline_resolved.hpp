// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the nodes of a pipeline are made from: references, options, bodies and axes.
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/pipeline/pipeline_text.hpp"

namespace marrow {

/// Replaces $name in a text by the value of the pipeline's input of that name, and $env:NAME by the environment
/// variable NAME. $$ stands for a dollar.
class InputTexts {
 public:
  InputTexts(const WrittenPipeline& pipeline, Diagnostics& diagnostics)
      : pipeline_(pipeline), diagnostics_(diagnostics) {}

  /// `inputs`: those of the file that the text is written in; null: none. Returns nothing if a name has no value. This
  /// is a fault only if it is not the name of a declared input.
  std::optional<std::string> put_into(const std::string& text, const Place& place, const DeclaredInputs* inputs);

  std::set<std::string> used, unknown;  ///< names of the pipeline's own inputs that were found so far

 private:
  std::optional<std::string> value_of(const std::string& name, const Place& place, const DeclaredInputs& inputs);

  const WrittenPipeline& pipeline_;
  Diagnostics& diagnostics_;
  std::size_t bytes_ = 0;  ///< of all values put in so far
};

/// The ids of nodes, and the ids that references have named so far.
struct NodeIds {
  std::vector<std::string> all;
  std::map<std::string, std::size_t> index;  ///< the index of each node, by its id
  std::set<std::string> used;                ///< named by references
  std::set<std::string> unknown;             ///< named by references, but no node has this id
};

/// Looks up node, node.output, node.item or node.output.item. `types` are the wanted types, or null if they are not
/// known. A node's id alone means its only output, or its only output of a wanted type.
Reference resolve_reference(const std::string& text, const Place& place, const std::vector<TypeInfo>* types,
                            const std::vector<PipelineNode>& nodes, NodeIds& ids, Diagnostics& diagnostics);

bool has_id(const std::vector<TypeInfo>& types, const std::string& id);

/// Options whose values could not be read, each with the node for which it was written.
using UnknownValues = std::set<std::pair<const WrittenNode*, std::string>>;

/// Sets the options of `node`. A written value is converted and checked; an option that is not written gets its
/// default.
void resolve_options(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts, UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// Checks the relations between options. A relation is checked only if each of its options could be read. A fault is
/// shown at the last of these options that the file gives.
void check_relations(const WrittenNode& written, const PipelineNode& node, const UnknownValues& unknown,
                     Diagnostics& diagnostics);

/// A note for each option that the pipeline gives without effect. A node can set again what its functions were made
/// with: the levels of a registration, for example, have their own resolution. Such an option of the node replaces the
/// option of the node that made the function (OptionInfo::replaces). Functions reach a node by its wires, also through
/// nodes that take and give functions of one type. `pipeline` has the nodes of `written`, in their order.
std::vector<std::string> notes_of_replaced_options(const WrittenPipeline& written, const Pipeline& pipeline);

/// A body that was read and checked as a pipeline.
struct ReadBody {
  Pipeline pipeline;
  std::set<std::string> incomplete;  ///< nodes with an option whose value is unknown, because an input has no value
};
using BodyReader = std::function<ReadBody(std::vector<InputValue> inputs)>;

/// Reads the body of a node, and makes the node's repetition, inputs and outputs from it. If the body has faults,
/// `node.info` stays empty.
void resolve_repetition(const WrittenNode& written, PipelineNode& node, InputTexts& input_texts,
                        const BodyReader& read_body, Diagnostics& diagnostics);

/// Checks that the values that a node gives to its body have the axes that the body expects.
void check_axes_of_repetition(const Pipeline& pipeline, const PipelineNode& node, Diagnostics& diagnostics);

/// Sorts the nodes so that sources come before users, else in the order of the file. Then finds the axes along which
/// each node is called. All references must be resolved, and no nodes may wait for each other (check_circles()).
void order_and_find_axes(Pipeline& pipeline, Diagnostics& diagnostics);

}  // namespace marrow
