// SPDX-License-Identifier: Apache-2.0
#pragma once
// Landmarks of a model at a known pose, and views that see them.
#include "tests/harness/node_test.hpp"

namespace marrow::test::scene {

inline Value model() { return item(cylinder({0, 0, 50}, {0, 0, 1}, 15, 120, 32)); }

inline RigidTransform exact_pose() { return {"world", "ct", rotation_from_vector({0.3, -0.5, 0.8}), {12, -20, -35}}; }

/// Six points, a few centimetres apart.
inline std::vector<Vector3d> spread() {
  return {{25, 0, -10}, {-22, 5, -8}, {3, 24, 20}, {-6, -20, 45}, {14, -4, 80}, {-12, 9, 105}};
}

/// Cameras 600 mm from the origin with a focal length of 1700 px, turned about z by 0, 90 and 45 degrees.
inline List<View> views() {
  List<View> views;
  for (const auto& [name, angle_deg] : {std::pair{"frontal", 0.0}, {"lateral", 90.0}, {"oblique", 45.0}}) {
    Camera camera = before_origin(pinhole(1700, 512, 512), 600);
    camera.camera_from_world.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    camera.camera_from_world.rotation *= rotation_from_vector({0, 0, radians(angle_deg)});
    views.add(name, view_of(name, camera));
  }
  return views;
}

/// How far the model's centroid lies from where it is.
inline double off_mm(const Pose& pose) {
  return (pose.world_from_model * Vector3d(0, 0, 50) - exact_pose() * Vector3d(0, 0, 50)).norm();
}

/// Points, named by their places, exactly where views see them and a tracker finds them.
inline Landmarks seen_in(const std::vector<Vector3d>& points, const Strings& names) {
  Landmarks landmarks;
  const auto all = views();
  for (const Vector3d& point : points) {
    char name[40];
    std::snprintf(name, sizeof name, "p(%.3g %.3g %.3g)", point.x(), point.y(), point.z());
    landmarks.points.push_back({name, point});
    for (const std::string& view : names)
      landmarks.seen.push_back({name, view, project(all.find(view)->camera, exact_pose() * point)});
    landmarks.tracked.push_back({name, exact_pose() * point});
  }
  return landmarks;
}

}  // namespace marrow::test::scene
