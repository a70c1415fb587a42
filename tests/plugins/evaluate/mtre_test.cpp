// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/plugins/evaluate/poses.hpp"

namespace mtre_test {

using namespace known_poses;

TEST(Mtre, OfATranslationIsItsLengthEverywhere) {
  const auto metrics =
      shipped::call("evaluate.mtre",
                    {{"pose", shipped::item(shifted(3, 4, 12))}, {"truth", exact()}, {"model", tool_box()}})
          .at("metrics");
  for (const char* name : {"mtre_mm", "rms_mm", "max_mm"})
    EXPECT_NEAR(shipped::figure(metrics, name), 13, 1e-9) << name;
}

TEST(Mtre, OfAHalfTurnAtLandmarks) {
  // Half a turn about z moves a point by twice its distance from the axis: 6, 8 and 0 mm.
  marrow::Landmarks landmarks;
  landmarks.points = {{"a", {3, 0, 5}}, {"b", {0, -4, 9}}, {"c", {0, 0, 20}}};
  marrow::Pose pose;
  pose.world_from_model.rotation = Eigen::Vector3d(-1, -1, 1).asDiagonal();
  const auto metrics =
      shipped::call("evaluate.mtre",
                    {{"pose", shipped::item(pose)}, {"truth", exact()}, {"landmarks", shipped::item(landmarks)}})
          .at("metrics");
  EXPECT_NEAR(shipped::figure(metrics, "mtre_mm"), 14.0 / 3, 1e-12);
  EXPECT_NEAR(shipped::figure(metrics, "rms_mm"), std::sqrt(100.0 / 3), 1e-12);
  EXPECT_NEAR(shipped::figure(metrics, "max_mm"), 8, 1e-12);
}

TEST(Mtre, SaysWhatIsWrong) {
  EXPECT_EQ(shipped::refusal("evaluate.mtre", {{"pose", shipped::item(shifted(0, 0, 0))}, {"truth", exact()}}),
            "there is nothing to measure at; wire a model, whose surface is sampled, or landmarks");
  EXPECT_EQ(shipped::refusal("evaluate.mtre", {{"pose", shipped::item(shifted(0, 0, 0))},
                                               {"truth", exact()},
                                               {"landmarks", shipped::item(marrow::Landmarks())}}),
            "the landmarks have no points in the CT; leave them out to measure on the model's surface");
  marrow::Mesh other = marrow::test::box({0, 0, 0}, {1, 1, 1});
  other.frame = "stl";
  EXPECT_EQ(shipped::refusal(
                "evaluate.mtre",
                {{"pose", shipped::item(shifted(0, 0, 0))}, {"truth", exact()}, {"model", shipped::item(other)}}),
            "the model is in the frame 'stl', but the pose takes points in 'ct'; give the model that was registered");
  const marrow::Mesh line{{{0, 0, 0}, {0, 0, 1}, {0, 0, 3}}, {{0, 1, 2}}};
  EXPECT_EQ(
      shipped::refusal("evaluate.mtre",
                       {{"pose", shipped::item(shifted(0, 0, 0))}, {"truth", exact()}, {"model", shipped::item(line)}}),
      "model: the surface has no area, as all its triangles are points or lines; check the file or the node that it is "
      "from");
  marrow::Pose pose;
  pose.world_from_model.source = "mri";
  EXPECT_EQ(
      shipped::refusal("evaluate.mtre", {{"pose", shipped::item(pose)}, {"truth", exact()}, {"model", tool_box()}}),
      "the pose is world_from_mri, but the truth is world_from_ct; compare poses between the same two frames");
}

}  // namespace mtre_test
