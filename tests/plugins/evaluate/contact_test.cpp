// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "marrow/toolbox/analytic/body.hpp"
#include "shipped.hpp"

namespace contact_test {

using namespace marrow;

analytic::Body ball() { return {{{0, 0, 0}, {10, 10, 10}}}; }

/// Balls of 10 mm radius, one at the origin, the other with its middle at x.
shipped::Inputs balls(double x_mm) {
  const auto field =
      std::make_shared<const SignedField>(field_of(ball(), analytic::grid_of({61, 61, 61}, {0.5, 0.5, 0.5}), 4));
  const auto model = std::make_shared<const Mesh>(mesh_of(ball()));
  List<Pose> poses;
  List<Mesh> models;
  List<SignedField> fields;
  for (const std::string name : {"a", "b"}) {
    Pose pose;
    pose.world_from_model = analytic::moved_by({0, 0, 0}, {name == "a" ? 0 : x_mm, 0, 0});
    poses.add(name, pose);
    models.add_shared(name, model);
    fields.add_shared(name, field);
  }
  return {{"poses", shipped::list(poses, "fragment")},
          {"models", shipped::list(models, "fragment")},
          {"fields", shipped::list(fields, "fragment")}};
}

double figure(const std::vector<Metric>& items, const std::string& name) {
  for (const Metric& one : items)
    if (one.name == name) return one.value;
  ADD_FAILURE() << "no " << name;
  return 0;
}

TEST(Contact, PenetrationAndGapOfTwoBalls) {
  for (const double gap_mm : {-2.0, -0.5, 1.0, 3.0}) {
    const Value made = shipped::call("evaluate.contact", balls(20 + gap_mm)).at("metrics");
    const auto& items = made.as<Metrics>().items;
    EXPECT_NEAR(figure(items, "a.b.penetration_mm"), std::max(0.0, -gap_mm), 0.1) << gap_mm;
    EXPECT_NEAR(figure(items, "a.b.gap_mm"), gap_mm + 0.15, 0.15) << gap_mm;  // within the weights' fall of 0.2 mm
  }
}

TEST(Contact, RefusesOneBoneAndABoneWithoutAField) {
  shipped::Inputs one = balls(20);
  List<Pose> poses;
  poses.add("a", Pose());
  one["poses"] = shipped::list(poses, "fragment");
  EXPECT_EQ(shipped::refusal("evaluate.contact", one),
            "there are fewer than two bones, so nothing can touch; give the poses of two at least");
  poses.add("c", Pose());
  one["poses"] = shipped::list(poses, "fragment");
  EXPECT_EQ(shipped::refusal("evaluate.contact", one),
            "poses has the bone 'c', but models has not; give all of them for the same fragments");
}

}  // namespace contact_test
