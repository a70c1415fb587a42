// SPDX-License-Identifier: Apache-2.0
#pragma once
// Functions that nodes written in Python make: costs, optimizers and projectors of radiographs.
#include "marrow/runtime/plugins/python_nodes.hpp"

namespace marrow {

/// A function of a node, which a process keeps under a number. A process that does not have it makes it first.
class PythonFunction {
 public:
  PythonFunction(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
                 const std::vector<OptionValue>& options);

  const std::string& name() const { return node_.name; }
  /// Has a process make the function, so that a fault of its inputs is reported at once.
  nlohmann::json make(Context& context) const;
  /// Has a process answer a request about the function, as PythonNodes::ask() does.
  nlohmann::json ask(nlohmann::json request, std::vector<Value>* outputs = nullptr,
                     const PythonNodes::Reply& reply = nullptr) const;

  /// The functions among its inputs.
  const AskedFunctions& functions() const { return *arguments_.functions; }
  /// The same function, made of costs at a level. Another one, so a process makes it anew.
  PythonFunction at_level(const CostLevel& level) const;

 private:
  std::shared_ptr<PythonNodes> nodes_;
  NodeInfo node_;
  std::vector<Value> inputs_;
  std::vector<OptionValue> options_;
  std::shared_ptr<const PythonFunction> origin_;  ///< costs at a level may refer to its inputs
  PythonArguments arguments_;
  std::uint64_t number_ = 0;
};

std::shared_ptr<const RadiographProjector> python_projector(PythonFunction function, Context& context);

/// Whether the node makes a function and not data.
bool makes_function(const NodeInfo& node);

/// What such a node makes. Throws as PythonNodes::ask() does if it cannot be made.
Value value_of_function(const NodeInfo& node, PythonFunction function, Context& context);

}  // namespace marrow
