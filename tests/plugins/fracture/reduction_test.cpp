// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/fracture/fragments.hpp"

namespace marrow::test::reduction_test {

using namespace broken_shaft;

List<Pose> displaced() {
  return poses(motion(turn(14, Vector3d(0.2, -0.5, 0.8).normalized()), {5, 3, 60}, {6, -2, 9}));
}

TEST(Reduction, BringsTheFragmentBackBesideTheOther) {
  const auto given = displaced();
  const Outputs result = call("fracture.reduction", inputs(given));
  const auto& found = result.at("pose").as<Pose>().world_from_model;
  const Value& moved = result.at("metrics");
  EXPECT_TRUE(found.rotation.isApprox(given[0].world_from_model.rotation, 1e-12));
  EXPECT_TRUE(found.translation_mm.isApprox(given[0].world_from_model.translation_mm, 1e-12));
  EXPECT_NEAR(figure(moved, "turn_deg"), 14, 1e-9);
  // The motion that is told, applied in the world about the fragment's middle, does the same.
  const Vector3d turn_deg(figure(moved, "turn_x_deg"), figure(moved, "turn_y_deg"), figure(moved, "turn_z_deg"));
  const Vector3d shift(figure(moved, "shift_x_mm"), figure(moved, "shift_y_mm"), figure(moved, "shift_z_mm"));
  EXPECT_NEAR(turn_deg.norm(), figure(moved, "turn_deg"), 1e-9);
  EXPECT_NEAR(shift.norm(), figure(moved, "shift_mm"), 1e-9);
  const Matrix3d whole = rotation_from_vector(radians(1) * turn_deg);
  const Vector3d middle = given[1].world_from_model * given[1].frame.origin_mm;
  for (const Vector3d& point : {Vector3d(0, 0, 0), Vector3d(10, -5, 90)})
    EXPECT_TRUE((middle + whole * (given[1].world_from_model * point - middle) + shift)
                    .isApprox(given[0].world_from_model * point, 1e-9));
}

TEST(Reduction, IsAboutTheFragmentsMiddleEvenIfThePoseDoesNotSayWhereThatIs) {
  // Turned about its own middle, so nothing is to be shifted. About the CT's origin it would be tens of mm.
  const Vector3d middle_mm = fragment_frame(*models().find("distal")).origin_mm;
  const auto given = without_axes(poses(motion(turn(20, Vector3d::UnitX()), middle_mm)));
  const auto found = call("fracture.reduction", inputs(given));
  EXPECT_NEAR(figure(found.at("metrics"), "shift_mm"), 0, 1e-9);
  EXPECT_EQ(found.at("pose").as<Pose>().frame.origin_mm, middle_mm);
  Inputs without = inputs(given);
  without.erase("models");
  EXPECT_EQ(
      refusal("fracture.reduction", without),
      "the pose of 'distal' does not say where the fragment's middle is and how its long axis runs, as a matrix alone "
      "does not; wire the surfaces of both fragments to 'models', or give the node that reads the pose its model");
}

}  // namespace marrow::test::reduction_test
