// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "tests/harness/message_of.hpp"
#include "tests/plugins/plan/implants.hpp"

namespace evaluate_locking_test {

using Eigen::Vector3d;
using marrow::geometry::LockingPlan;

/// A plan for a hole at the isocentre along x, whose drill is turned about z and shifted.
LockingPlan plan(double turn_deg, const Vector3d& shift_mm) {
  LockingPlan::Drill drill;
  drill.hole = "distal";
  drill.centre_mm = shift_mm;
  const double turn = marrow::radians(turn_deg);
  drill.direction = {-std::cos(turn), -std::sin(turn), 0};  // its sense does not matter
  drill.beta_deg = 90;
  LockingPlan plan;
  plan.drills = {drill};
  return plan;
}

shipped::Outputs errors(const LockingPlan& plan) {
  const marrow::Truth truth{implants::pose({0, 0, 0}, {0, 0, 50}, {0, 0, 0}).world_from_model};
  return shipped::call(
      "evaluate.locking",
      {{"plan", shipped::item(plan)}, {"implant", shipped::item(implants::rod())}, {"truth", shipped::item(truth)}});
}

TEST(EvaluateLocking, AngleOffsetAndView) {
  const auto outputs = errors(plan(0.8, {7, 0.3, 0.4}));
  const marrow::Value& summary = outputs.at("metrics");
  EXPECT_NEAR(shipped::figure(summary, "angle_deg"), 0.8, 1e-9);
  EXPECT_NEAR(shipped::figure(summary, "offset_mm"), 0.5, 1e-9) << "along the axis does not count";
  EXPECT_NEAR(shipped::figure(summary, "view_deg"), 0, 1e-9) << "at 90 degrees the rays run along x";
  EXPECT_EQ(shipped::figure(summary, "off"), 0);
  LockingPlan turned = plan(0, {0, 0, 0});
  turned.drills[0].beta_deg = 88.5;
  EXPECT_NEAR(shipped::figure(errors(turned).at("metrics"), "view_deg"), 1.5, 1e-9);
  turned.isocentre_mm = {0, 0, 600};  // then the ray to the hole is oblique
  EXPECT_NEAR(shipped::figure(errors(turned).at("metrics"), "view_deg"), 45.02, 0.01);
}

TEST(EvaluateLocking, SilentIsOffAndNotDoubted) {
  LockingPlan off = plan(1.2, {0, 0, 0});
  EXPECT_EQ(shipped::figure(errors(off).at("metrics"), "off"), 1);
  EXPECT_EQ(shipped::figure(errors(off).at("metrics"), "silent"), 1);
  off.drills[0].doubts = {"doubtful"};
  EXPECT_EQ(shipped::figure(errors(off).at("metrics"), "silent"), 0);
  EXPECT_EQ(shipped::figure(errors(off).at("metrics"), "flagged"), 1);
  EXPECT_EQ(shipped::figure(errors(plan(0, {0, 0.6, 0})).at("metrics"), "silent"), 1);
}

TEST(EvaluateLocking, RefusesAPlanForAnotherImplant) {
  LockingPlan other = plan(0, {0, 0, 0});
  other.drills[0].hole = "proximal";
  EXPECT_EQ(marrow::test::message_of([&] { errors(other); }),
            "evaluate.locking: the plan has a drill for hole 'proximal', but the implant has no such hole; give "
            "the implant of the plan");
}

}  // namespace evaluate_locking_test
