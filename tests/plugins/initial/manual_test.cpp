// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "shipped.hpp"
#include "tests/plugins/evaluate/listener.hpp"
#include "tests/plugins/initial/tube.hpp"

namespace manual_test {

marrow::Pose manual(shipped::Inputs inputs, const marrow::Mesh& model, const shipped::Options& options) {
  inputs["model"] = shipped::item(model);
  return shipped::call("initial.manual", inputs, options).at("pose").as<marrow::Pose>();
}

TEST(Manual, MovesAboutTheFragmentsOwnAxes) {
  const marrow::Mesh model = tube::mesh(
      90, [](double, double) { return 14.0; }, [](double) { return Eigen::Vector3d(30, 0, 0); });
  const marrow::Pose pose = manual(
      {}, model, {{"rotation_deg", std::vector<double>{0, 0, 90}}, {"translation_mm", std::vector<double>{1, 2, 3}}});
  EXPECT_LT((pose.frame.origin_mm - Eigen::Vector3d(30, 0, 0)).norm(), 1e-9);
  EXPECT_LT((pose.world_from_model * pose.frame.origin_mm - Eigen::Vector3d(31, 2, 3)).norm(), 1e-6);
  EXPECT_LT((pose.world_from_model * Eigen::Vector3d(44, 0, 0) - Eigen::Vector3d(31, 16, 3)).norm(), 1e-6);
}

TEST(Manual, StartsFromTheNominalPlacement) {
  const marrow::Mesh model = tube::cylinder(14, 90);
  marrow::Pose start;
  start.world_from_model.translation_mm = {0, 0, 50};
  start.world_from_model.rotation = marrow::rotation_from_vector({0, 0, marrow::kPi / 2});
  const shipped::Inputs inputs{{"start", shipped::item(start)}};
  EXPECT_EQ(manual(inputs, model, {}).world_from_model.translation_mm, start.world_from_model.translation_mm);
  // Along the fragment's own x, which is the world's y here.
  const marrow::Pose pose = manual(inputs, model, {{"translation_mm", std::vector<double>{10, 0, 0}}});
  EXPECT_LT((pose.world_from_model.translation_mm - Eigen::Vector3d(0, 10, 50)).norm(), 1e-9);
}

// The mean distance that a tube's surface moves, by integration: a shift moves all points alike.
TEST(Manual, ScalesToADistance) {
  const marrow::Mesh model = tube::cylinder(14, 90);
  shipped::Options options{{"translation_mm", std::vector<double>{3, 0, 4}}, {"distance_mm", 12.0}};
  EXPECT_LT((manual({}, model, options).world_from_model.translation_mm - Eigen::Vector3d(7.2, 0, 9.6)).norm(), 1e-6);
  options["rotation_deg"] = std::vector<double>{5, -3, 2};
  const marrow::Pose pose = manual({}, model, options);
  double sum = 0;
  const auto points_mm = marrow::sample_surface(model, 3000);
  for (const auto& point : points_mm) sum += (pose.world_from_model * point - point).norm() / 3000;
  EXPECT_NEAR(sum, 12, 0.05);
}

TEST(Manual, RefusesADistanceWithoutAMotion) {
  EXPECT_EQ(
      shipped::refusal("initial.manual", {{"model", shipped::item(tube::cylinder(14, 90))}}, {{"distance_mm", 5.0}}),
      "distance_mm: no multiple of rotation_deg and translation_mm moves the surface that far; give a rotation or "
      "translation, or a shorter distance");
}

TEST(Manual, FailsWithoutAStartIfItNeedsOne) {
  EXPECT_EQ(
      shipped::refusal("initial.manual", {{"model", shipped::item(tube::cylinder(14, 90))}}, {{"needs_start", true}}),
      "there is no start; give the approximate placement of the fragment, in case.yaml under 'start' (docs/case.md)");
}

TEST(Manual, RefusesAnEmptyModel) {
  EXPECT_EQ(shipped::refusal("initial.manual", {{"model", shipped::item(marrow::Mesh{})}}),
            "model: the surface has no triangles");
}

TEST(Manual, SaysThatWithoutAStartTheCtIsTheWorld) {
  listener::Listener listener;
  shipped::Inputs inputs{{"model", shipped::item(tube::cylinder(14, 90))}};
  shipped::call("initial.manual", inputs, {}, listener.context);
  EXPECT_EQ(listener.warnings,
            std::vector<std::string>{
                "there is no start, so CT coordinates are taken as world coordinates; if the bone is elsewhere in the "
                "images, give its approximate placement, in case.yaml under 'start' (docs/case.md)"});
  listener.warnings.clear();
  inputs["start"] = shipped::item(marrow::Pose());
  shipped::call("initial.manual", inputs, {}, listener.context);
  EXPECT_TRUE(listener.warnings.empty());
}

}  // namespace manual_test
