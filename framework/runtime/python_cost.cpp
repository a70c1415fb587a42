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

  /// Has a process make the cost, so that what is wrong with its inputs is said at once.
  void make(Context& context) const { ask(json::array(), context); }

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
    auto values = ask(poses, context).at("values").get<std::vector<double>>();
    if (values.size() != world_from_model.size())
      throw Error(node_.name + " gave " + std::to_string(values.size()) + " costs for " +
                  std::to_string(world_from_model.size()) + " poses");
    return values;
  }
  /// It has one resolution only.
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<PythonCost>(*this); }

 private:
  json ask(const json& poses, Context& context) const {
    return nodes_->ask(node_, {{"do", "cost"}, {"cost", number_}, {"poses", poses}}, arguments_, context, nullptr);
  }

  std::shared_ptr<PythonNodes> nodes_;
  NodeInfo node_;
  std::vector<Value> inputs_;
  PythonArguments arguments_;
  std::uint64_t number_ = 0;
};

}  // namespace

Value python_cost(std::shared_ptr<PythonNodes> nodes, const NodeInfo& node, const std::vector<Value>& inputs,
                  const std::vector<OptionValue>& options, Context& context) {
  const auto cost = std::make_shared<const PythonCost>(std::move(nodes), node, inputs, options);
  cost->make(context);
  return Value::of<Cost>(std::shared_ptr<const Cost>(cost));
}

}  // namespace marrow
