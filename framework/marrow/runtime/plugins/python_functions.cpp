// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_functions.hpp"

#include <atomic>

#include "marrow/runtime/node/types.hpp"

namespace marrow {

using nlohmann::json;

PythonFunction::PythonFunction(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
                               const std::vector<OptionValue>& options)
    : nodes_(std::move(nodes)), node_(std::move(node)), inputs_(std::move(inputs)), arguments_(inputs_, options) {
  static std::atomic<std::uint64_t> made{0};
  number_ = ++made;
}

json PythonFunction::make(Context& context) const {
  return nodes_->ask(node_, {{"do", "make"}, {"function", number_}}, arguments_, context, nullptr);
}

json PythonFunction::ask(json request, std::vector<Value>* outputs, const PythonNodes::Reply& reply) const {
  Context context;
  request["function"] = number_;
  return nodes_->ask(node_, std::move(request), arguments_, context, outputs, reply);
}

json json_of_transform(const RigidTransform& transform) {
  json numbers = json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) numbers.push_back(transform.rotation(row, column));
    numbers.push_back(transform.translation_mm[row]);
  }
  return numbers;
}

bool makes_function(const NodeInfo& node) { return node.outputs.size() == 1 && node.outputs[0].type.is_function; }

Value value_of_function(const NodeInfo& node, PythonFunction function, Context& context) {
  const TypeInfo& type = node.outputs.at(0).type;
  if (type == TypeInfo::of<Cost>()) return Value::of<Cost>(python_cost(std::move(function), context));
  if (type == TypeInfo::of<Optimizer>()) return Value::of<Optimizer>(python_optimizer(std::move(function)));
  if (type == TypeInfo::of<RadiographProjector>())
    return Value::of<RadiographProjector>(python_projector(std::move(function), context));
  throw Error(node.name + " makes a '" + type.id + "', which cannot be written in Python");
}

}  // namespace marrow
