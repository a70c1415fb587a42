// SPDX-License-Identifier: Apache-2.0
#pragma once
// Landmarks of a model at a known pose, and views that see them.
#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace scene {

inline marrow::Value model() { return shipped::item(marrow::test::cylinder({0, 0, 50}, {0, 0, 1}, 15, 120, 32)); }

inline marrow::RigidTransform exact_pose() {
  return {"world", "ct", marrow::rotation_from_vector({0.3, -0.5, 0.8}), {12, -20, -35}};
}

/// Six points, a few centimetres apart.
inline std::vector<Eigen::Vector3d> spread() {
  return {{25, 0, -10}, {-22, 5, -8}, {3, 24, 20}, {-6, -20, 45}, {14, -4, 80}, {-12, 9, 105}};
}

/// Cameras 600 mm from the origin with a focal length of 1700 px, turned about z by 0, 90 and 45 degrees.
inline marrow::List<marrow::View> views() {
  marrow::List<marrow::View> views;
  for (const auto& [name, angle_deg] : {std::pair{"frontal", 0.0}, {"lateral", 90.0}, {"oblique", 45.0}}) {
    marrow::View view;
    view.name = name;
    view.camera.width_px = view.camera.height_px = 512;
    view.camera.intrinsics << 1700, 0, 255.5, 0, 1700, 255.5, 0, 0, 1;
    Eigen::Matrix3d frontal;
    frontal << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    view.camera.camera_from_world.rotation = frontal * marrow::rotation_from_vector({0, 0, marrow::radians(angle_deg)});
    view.camera.camera_from_world.translation_mm = {0, 0, 600};
    views.add(view.name, view);
  }
  return views;
}

/// Points, named by their places, exactly where views see them and a tracker finds them.
inline marrow::Landmarks seen_in(const std::vector<Eigen::Vector3d>& points, const std::vector<std::string>& names) {
  marrow::Landmarks landmarks;
  const auto all = views();
  for (const Eigen::Vector3d& point : points) {
    char name[40];
    std::snprintf(name, sizeof name, "p(%.3g %.3g %.3g)", point.x(), point.y(), point.z());
    landmarks.points.push_back({name, point});
    for (const std::string& view : names)
      landmarks.seen.push_back({name, view, project(all.find(view)->camera, exact_pose() * point)});
    landmarks.tracked.push_back({name, exact_pose() * point});
  }
  return landmarks;
}

}  // namespace scene
