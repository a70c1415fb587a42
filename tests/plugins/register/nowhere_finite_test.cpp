// SPDX-License-Identifier: Apache-2.0
// A cost that is nowhere a number, against its contract: no search may end in a pose.
#include <gtest/gtest.h>

#include <cmath>

#include "shipped.hpp"

namespace nowhere_finite_test {

class Nowhere : public marrow::Cost {
 public:
  double value(const marrow::RigidTransform&) const override { return std::nan(""); }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override {
    return std::make_shared<const Nowhere>();
  }
};

TEST(NowhereFinite, ASearchSaysSo) {
  for (const char* node : {"register.multiresolution", "register.tracked"}) {
    const shipped::Inputs inputs{{"cost", marrow::Value::of<marrow::Cost>(std::make_shared<const Nowhere>())},
                                 {"optimizer", shipped::call("optimizer.nelder_mead", {}).at("optimizer")},
                                 {"start", shipped::item(marrow::Pose())}};
    const std::string said = shipped::refusal(node, inputs, {});
    EXPECT_TRUE(said.starts_with("the optimizer found no least value: the function is not finite at any of the "))
        << node << ": " << said;
  }
}

}  // namespace nowhere_finite_test
