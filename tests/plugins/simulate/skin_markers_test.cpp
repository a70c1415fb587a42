// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>
#include <marrow/domain/pose.hpp>

#include "marrow/toolbox/phantom/phantom.hpp"
#include "shipped.hpp"

namespace skin_markers_test {

using marrow::Landmarks;

/// A broken femur, made only once. It is coarse, because each call checks its surface.
const marrow::Value& phantom() {
  static const marrow::Value phantom = [] {
    const auto bone = shipped::call("simulate.femur", {}, {{"resolution_mm", 6.0}}).at("bone");
    return shipped::call(
               "simulate.fracture", {{"bone", bone}},
               {{"rotation_deg", std::vector<double>{4, -5, 7}}, {"translation_mm", std::vector<double>{5, -4, 6}}})
        .at("phantom");
  }();
  return phantom;
}

const marrow::phantom::Fragment& distal() {
  return marrow::phantom::distal_fragment(phantom().as<marrow::phantom::Phantom>());
}

Landmarks markers(shipped::Options options, std::uint64_t seed = 1) {
  for (const char* name : {"noise_mm", "common_rotation_deg", "common_shift_mm"})
    if (!options.count(name)) options[name] = 0.0;
  return *shipped::call("simulate.skin_markers", {{"phantom", phantom()}}, options, marrow::Context(seed))
              .at("landmarks")
              .as_list<Landmarks>()
              .find("distal");
}

/// The place of a marker, along the axes of the distal fragment.
Eigen::Vector3d in_axes(const Eigen::Vector3d& model_mm) {
  return distal().frame.axes.transpose() * (model_mm - distal().frame.origin_mm);
}

TEST(SimulateSkinMarkers, LieAroundTheLongAxisAndAlongIt) {
  const Landmarks found = markers({{"count", std::int64_t(5)}, {"radius_mm", 60.0}, {"length_mm", 100.0}});
  ASSERT_EQ(found.points.size(), 5u);
  double low = 1e9, high = -1e9;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const auto& point : found.points) {
    const Eigen::Vector3d at = in_axes(point.model_mm);
    EXPECT_NEAR(at.head<2>().norm(), 60, 6.001);
    low = std::min(low, at.z());
    high = std::max(high, at.z());
    sum += at.head<2>();
  }
  EXPECT_NEAR(low, -50, 3);
  EXPECT_NEAR(high, 50, 3);
  EXPECT_LT(sum.norm() / 5, 20) << "they are all around the limb";
  EXPECT_EQ(found.points[4].name, "m5");
}

TEST(SimulateSkinMarkers, WithoutErrorsAreTrackedWhereTheTruthHasThem) {
  const Landmarks found = markers({});
  ASSERT_EQ(found.tracked.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(found.tracked[i].name, found.points[i].name);
    EXPECT_LT((found.tracked[i].world_mm - distal().world_from_ct * found.points[i].model_mm).norm(), 1e-9);
  }
}

TEST(SimulateSkinMarkers, AFalseRotationTurnsAllOfThemAboutTheLongAxis) {
  const Landmarks found = markers({{"false_rotation_deg", 20.0}});
  const marrow::RigidTransform ct_from_world = inverse(distal().world_from_ct);
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d before = in_axes(found.points[i].model_mm),
                          after = in_axes(ct_from_world * found.tracked[i].world_mm);
    EXPECT_NEAR(after.z(), before.z(), 1e-9);
    const double cosine = std::cos(marrow::radians(20)), sine = std::sin(marrow::radians(20));
    EXPECT_NEAR(after.x(), cosine * before.x() - sine * before.y(), 1e-9);
    EXPECT_NEAR(after.y(), sine * before.x() + cosine * before.y(), 1e-9);
  }
}

TEST(SimulateSkinMarkers, ErrorsHaveTheDeviationsThatWereAsked) {
  constexpr int kRuns = 200;
  double own = 0, turn = 0, shift = 0;
  const marrow::RigidTransform ct_from_world = inverse(distal().world_from_ct);
  for (int seed = 1; seed <= kRuns; ++seed) {
    const Landmarks noisy = markers({{"noise_mm", 3.0}}, std::uint64_t(seed));
    for (std::size_t i = 0; i < 4; ++i)
      own += (noisy.tracked[i].world_mm - distal().world_from_ct * noisy.points[i].model_mm).squaredNorm();
    const Landmarks turned = markers({{"common_rotation_deg", 6.0}}, std::uint64_t(seed));
    const Eigen::Vector3d a = in_axes(turned.points[0].model_mm),
                          b = in_axes(ct_from_world * turned.tracked[0].world_mm);
    turn += std::pow(marrow::degrees(std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y())), 2);
    const Landmarks shifted = markers({{"common_shift_mm", 4.0}}, std::uint64_t(seed));
    const Eigen::Vector3d first = shifted.tracked[0].world_mm - distal().world_from_ct * shifted.points[0].model_mm;
    for (std::size_t i = 1; i < 4; ++i)
      EXPECT_LT((shifted.tracked[i].world_mm - distal().world_from_ct * shifted.points[i].model_mm - first).norm(),
                1e-9);
    shift += first.squaredNorm();
  }
  EXPECT_NEAR(std::sqrt(own / (12 * kRuns)), 3, 0.1);
  EXPECT_NEAR(std::sqrt(turn / kRuns), 6, 0.5);
  EXPECT_NEAR(std::sqrt(shift / (3 * kRuns)), 4, 0.25);
}

TEST(SimulateSkinMarkers, DependOnTheSeedAlone) {
  const shipped::Options noisy{{"noise_mm", 3.0}};
  EXPECT_EQ(markers(noisy, 5).tracked[2].world_mm, markers(noisy, 5).tracked[2].world_mm);
  EXPECT_NE(markers(noisy, 5).tracked[2].world_mm, markers(noisy, 6).tracked[2].world_mm);
}

}  // namespace skin_markers_test
