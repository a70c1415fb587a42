// SPDX-License-Identifier: Apache-2.0
// Costs written in Python: a process makes the cost once, and gets the poses in batches.
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/plugins/python_functions.hpp"

namespace marrow {
namespace {

using nlohmann::json;

class PythonCost : public Cost {
 public:
  explicit PythonCost(PythonFunction function) : function_(std::move(function)) {}

  double value(const RigidTransform& world_from_model) const override { return values({world_from_model}).at(0); }
  std::vector<double> values(const std::vector<RigidTransform>& world_from_model) const override {
    if (world_from_model.empty()) return {};
    json poses = json::array();
    for (const RigidTransform& pose : world_from_model)
      for (const json& number : json_of_transform(pose)) poses.push_back(number);
    const json answer = function_.ask({{"do", "cost"}, {"poses", poses}});
    auto values = answer.at("values").get<std::vector<double>>();
    if (values.size() != world_from_model.size())
      throw Error(formatted("{} gave {} costs for {} poses", function_.name(), values.size(), world_from_model.size()));
    return values;
  }
  /// It has one resolution only.
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<PythonCost>(*this); }

 private:
  PythonFunction function_;
};

}  // namespace

std::shared_ptr<const Cost> python_cost(PythonFunction function, Context& context) {
  function.make(context);
  return std::make_shared<const PythonCost>(std::move(function));
}

}  // namespace marrow
