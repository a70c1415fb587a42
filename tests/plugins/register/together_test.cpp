// SPDX-License-Identifier: Apache-2.0
// register.together on two bones that give way to each other: everything is known by hand.
#include "bowl.hpp"
#include "marrow/toolbox/match/bones_together.hpp"

namespace marrow::test::together_test {

constexpr double kInformation = 100;

/// (x . x + y . y) / 2 + coupling x . y, of the ways x and y of both bones from their bottoms. The other bone is at y.
class Coupled : public well::Bowl, public match::CostAmongOthers {
 public:
  Coupled(const Pose& bottom, const Pose& bottom_of_other, std::string other, double coupling)
      : Bowl(bottom.world_from_model, bottom.frame, Matrix6d::Identity(), kInformation),
        bottom_(bottom),
        bottom_of_other_(bottom_of_other),
        other_(std::move(other)),
        coupling_(coupling),
        at_(bottom_of_other.world_from_model) {}

  double value(const RigidTransform& pose) const override {
    const Vector6d x = well::way(bottom_.world_from_model, pose, bottom_.frame),
                   y = well::way(bottom_of_other_.world_from_model, at_, bottom_of_other_.frame);
    return 0.5 * x.squaredNorm() + 0.5 * y.squaredNorm() + coupling_ * x.dot(y);
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Coupled>(*this); }
  std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const override {
    auto cost = std::make_shared<Coupled>(*this);
    if (const RigidTransform* pose = world_from_others.find(other_)) cost->at_ = *pose;
    return cost;
  }

 private:
  Pose bottom_, bottom_of_other_;
  std::string other_;
  double coupling_;
  RigidTransform at_;
};

Pose first() { return well::truth(); }
Pose second() { return well::pose_at(well::truth(), 10, -5, 20, 30, 4, -2); }

Inputs inputs(double coupling) {
  List<Cost> costs;
  costs.add_shared("first", std::make_shared<Coupled>(first(), second(), "second", coupling));
  costs.add_shared("second", std::make_shared<Coupled>(second(), first(), "first", coupling));
  return {{"costs", list(costs, "fragment")},
          {"starts", per_fragment("first", well::pose_at(first(), 1, -1, 2, 1, -1, 1), "second",
                                  well::pose_at(second(), 1, 2, 1, -1, 1, 2))},
          {"optimizer", call("optimizer.bobyqa", {}).at("optimizer")}};
}

class Coupling : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Together, Coupling, testing::Values(0.0, 0.6, -0.9));

/// In turn alone, an error falls by the squared coupling with each round: with 0.9, four rounds a level leave a fifth.
TEST_P(Coupling, BothBonesAreFound) {
  const auto out = call("register.together", inputs(GetParam()));
  const auto poses = out.at("poses").as_list<Pose>();
  ASSERT_EQ(poses.names(), (Strings{"first", "second"}));
  EXPECT_LT(well::apart(first(), poses[0]), 0.05);
  EXPECT_LT(well::apart(second(), poses[1]), 0.05);
  EXPECT_LT(well::apart(poses[0], out.at("pose").as<Pose>()), 1e-9);
}

/// With the other bone exact, each axis is known to 0.1. With the information (1, c; c, 1) of both, its variance is
/// 1 / (1 - c^2) times as large.
TEST_P(Coupling, TheDeviationsCountThoseOfTheOtherBone) {
  const auto poses = output_list<Pose>("register.together", "poses", inputs(GetParam()));
  const double expected = 0.1 / std::sqrt(1 - GetParam() * GetParam());
  for (const Pose& pose : poses)
    for (int axis = 0; axis < 6; ++axis) {
      const double deviation = std::sqrt((*pose.covariance)(axis, axis));
      EXPECT_NEAR(axis < 3 ? degrees(deviation) : deviation, expected, 0.05 * expected) << axis;
    }
}

TEST(Together, RefusesOtherBonesThanThoseOfTheCosts) {
  EXPECT_EQ(refusal("register.together", with(inputs(0), {{"starts", per_fragment("first", first())}})),
            "costs and starts are not of the same bones; wire both from nodes that are called for each fragment");
  EXPECT_EQ(refusal("register.together", with(inputs(0), {{"starts", list(List<Pose>(), "fragment")},
                                                          {"costs", list(List<Cost>(), "fragment")}})),
            "there is no bone; wire the start of at least one");
}

}  // namespace marrow::test::together_test
