// SPDX-License-Identifier: Apache-2.0
// Costs written in Python: a process makes the cost once, and gets the poses in batches.
#include <atomic>

#include "marrow/runtime/types.hpp"
#include "python_nodes.hpp"

namespace marrow {
namespace {

using nlohmann::json;

class PythonCost : public Cost {
 public:
  PythonCost(std::shared_ptr<PythonNodes> nodes, NodeInfo node, std::vector<Value> inputs,
             const std::vector<OptionValue>& options)
      : nodes_(std::move(nodes)), node_(std::move(node)), inputs_(std::move(inputs)), arguments_(inputs_, options) {
    static std::atomic<std::uint64_t> made{0};
    number_ = ++made;
  }

  double value(const RigidTransform& world_from_model) const override { return values({world_from_model}).at(0); }
  std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const override {
    if (world_from_model.empty()) return {};
    json poses = json::array();
    for (const RigidTransform& pose : world_from_model)
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) poses.push_back(pose.rotation(row, column));
        poses.push_back(pose.translation_mm[row]);
      }
    Context context;
    const json answer =
        nodes_->ask(node_, {{"do", "cost"}, {"cost", number_}, {"poses", poses}}, arguments_, context, nullptr);
    auto values = answer.at("values").get<std::vector<double>>();
    if (values.size() != world_from_model.size())
      throw Error(node_.name + " gave " + std::to_string(values.size()) + " costs for " +
                  std::to_string(world_from_model.size()) + " poses");
    return values;
  }
  /// It has one resolution only.
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<PythonCost>(*this); }

 private:
  std::shared_ptr<PythonNodes> nodes_;
  NodeInfo node_;
  std::vector<Value> inputs_;
  PythonArguments arguments_;
  std::uint64_t number_ = 0;
};

}  // namespace

Value python_cost(std::shared_ptr<PythonNodes> nodes, const NodeInfo& node, const std::vector<Value>& inputs,
                  const std::vector<OptionValue>& options) {
  return Value::of<Cost>(std::make_shared<const PythonCost>(std::move(nodes), node, inputs, options));
}

}  // namespace marrow
