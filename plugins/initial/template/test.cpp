// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <marrow/domain/mesh.hpp>
#include <marrow/domain/pose.hpp>
#include <marrow/testing/node.hpp>

namespace node_test = marrow::node_test;

namespace {

constexpr double kRadius_mm = 13;

/// A closed cylinder along z, 120 mm long.
marrow::Mesh cylinder() {
  constexpr std::uint32_t kSides = 120, kRings = 60;
  marrow::Mesh mesh;
  for (std::uint32_t ring = 0; ring <= kRings; ++ring)
    for (std::uint32_t side = 0; side < kSides; ++side) {
      const double angle = 2 * marrow::kPi * side / kSides;
      mesh.vertices_mm.emplace_back(kRadius_mm * std::cos(angle), kRadius_mm * std::sin(angle), 2.0 * ring - 60);
    }
  const auto at = [](std::uint32_t ring, std::uint32_t side) { return ring * kSides + side % kSides; };
  const std::uint32_t bottom = (kRings + 1) * kSides, top = bottom + 1;
  mesh.vertices_mm.emplace_back(0, 0, -60);
  mesh.vertices_mm.emplace_back(0, 0, 60);
  for (std::uint32_t side = 0; side < kSides; ++side) {
    mesh.triangles.push_back({bottom, at(0, side + 1), at(0, side)});
    mesh.triangles.push_back({top, at(kRings, side), at(kRings, side + 1)});
    for (std::uint32_t ring = 0; ring < kRings; ++ring) {
      mesh.triangles.push_back({at(ring, side), at(ring, side + 1), at(ring + 1, side + 1)});
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side + 1), at(ring + 1, side)});
    }
  }
  return mesh;
}

/// The borders in a view of the same cylinder whose axis goes upright through `axis_mm`: where rays touch it.
marrow::ShaftLines borders(const marrow::Camera& camera, const Eigen::Vector3d& axis_mm) {
  const Eigen::Vector3d to_source = marrow::source_position_mm(camera) - axis_mm;
  const double distance_mm = to_source.head<2>().norm(), cosine = kRadius_mm / distance_mm;
  const Eigen::Vector3d near = Eigen::Vector3d(to_source.x(), to_source.y(), 0) / distance_mm,
                        side = std::sqrt(1 - cosine * cosine) * Eigen::Vector3d::UnitZ().cross(near);
  std::array<double, 2> u_px;
  for (int i = 0; i < 2; ++i)
    u_px[std::size_t(i)] = project(camera, axis_mm + kRadius_mm * (cosine * near + (i ? side : -side))).x();
  marrow::ShaftLines lines;  // down the image, so left is at larger u
  lines.left = {{std::max(u_px[0], u_px[1]), 150}, {std::max(u_px[0], u_px[1]), 360}};
  lines.right = {{std::min(u_px[0], u_px[1]), 150}, {std::min(u_px[0], u_px[1]), 360}};
  return lines;
}

}  // namespace

TEST(NewNode, MovesTheAxisToWhereTwoViewsShowIt) {
  const Eigen::Vector3d axis_mm(5, -3, 0);
  const marrow::CArm arm{512, 512, Eigen::Vector2d::Constant(0.586), 1000, 600, Eigen::Vector3d::Zero()};
  marrow::List<marrow::View> views;
  marrow::List<marrow::ShaftLines> lines;
  for (const auto& [name, angle_deg] : {std::pair("frontal", 0.0), std::pair("lateral", 90.0)}) {
    marrow::View view;
    view.name = name;
    view.camera = marrow::carm_camera(arm, marrow::world_from_camera_rotation(0, marrow::radians(angle_deg)));
    lines.add(name, borders(view.camera, axis_mm));
    views.add(name, view);
  }
  const auto made = node_test::call("initial.new_node", {{"model", node_test::item(cylinder())},
                                                         {"lines", node_test::list(lines, "view")},
                                                         {"views", node_test::list(views, "view")}});
  const marrow::RigidTransform pose = made.at("pose").as<marrow::Pose>().world_from_model;
  const Eigen::Vector3d direction = pose.rotation.col(2);
  EXPECT_NEAR(std::abs(direction.z()), 1, 1e-4);
  EXPECT_NEAR(pose.translation_mm.x(), 5, 0.2);
  EXPECT_NEAR(pose.translation_mm.y(), -3, 0.2);
}
