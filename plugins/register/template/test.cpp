// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/functions.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

namespace {

/// Half the squared way from a pose that is known: 4 mm along x, and a turn of 3 degrees about z.
class Bowl : public marrow::Cost {
 public:
  double value(const marrow::RigidTransform& pose) const override {
    marrow::Vector6d way = motion_between(bottom(), pose, marrow::FragmentFrame());
    way.head<3>() *= marrow::degrees(1);
    return 0.5 * way.squaredNorm();
  }
  std::shared_ptr<const marrow::Cost> at_level(const marrow::CostLevel&) const override {
    return std::make_shared<const Bowl>();
  }
  static marrow::RigidTransform bottom() {
    return {"world", "ct", marrow::rotation_from_vector({0, 0, marrow::radians(3)}), {4, 0, 0}};
  }
};

}  // namespace

TEST(NewNode, FindsTheBottomOfABowl) {
  const marrow::Value cost = marrow::Value::of<marrow::Cost>(std::make_shared<const Bowl>());
  const marrow::Value optimizer = node_test::call("optimizer.bobyqa", {}).at("optimizer");
  marrow::Pose start;
  start.frame.is_anatomical = true;
  const auto found = node_test::call(
      "register.new_node",
      {{"cost", cost}, {"finer_cost", cost}, {"optimizer", optimizer}, {"start", node_test::item(start)}});
  const marrow::RigidTransform pose = found.at("pose").as<marrow::Pose>().world_from_model;
  EXPECT_NEAR((pose.translation_mm - Eigen::Vector3d(4, 0, 0)).norm(), 0, 0.05);
  EXPECT_NEAR(marrow::degrees(marrow::geodesic_angle_rad(pose.rotation, Bowl::bottom().rotation)), 0, 0.05);
}
