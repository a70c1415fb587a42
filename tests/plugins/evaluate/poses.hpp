// SPDX-License-Identifier: Apache-2.0
#pragma once
// Poses beside a truth, and views that see them, for figures that a hand can compute.
#include "shipped.hpp"
#include "tests/framework/domain/shapes.hpp"

namespace known_poses {

/// The truth of all tests: CT coordinates are the world's.
inline marrow::Value exact() { return shipped::item(marrow::Truth()); }

inline marrow::Pose shifted(double x_mm, double y_mm, double z_mm) {
  marrow::Pose pose;
  pose.world_from_model.translation_mm = {x_mm, y_mm, z_mm};
  return pose;
}

inline marrow::Value tool_box() { return shipped::item(marrow::test::box({0, 0, 0}, {20, 30, 60})); }

/// One landmark at the origin.
inline marrow::Value origin() {
  marrow::Landmarks landmarks;
  landmarks.points = {{"origin", {0, 0, 0}}};
  return shipped::item(landmarks);
}

/// Views "frontal", which looks along +y, and "lateral", along -x, at the origin from 600 mm, with a focal length of
/// 2000 px: a pixel is 0.3 mm there.
inline marrow::List<marrow::View> two_views() {
  marrow::List<marrow::View> views;
  for (const bool frontal : {true, false}) {
    marrow::View view;
    view.name = frontal ? "frontal" : "lateral";
    view.camera.width_px = view.camera.height_px = 512;
    view.camera.intrinsics << 2000, 0, 256, 0, 2000, 256, 0, 0, 1;
    if (frontal)
      view.camera.camera_from_world.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
    else
      view.camera.camera_from_world.rotation << 0, 1, 0, 0, 0, -1, -1, 0, 0;
    view.camera.camera_from_world.translation_mm = {0, 0, 600};
    views.add(view.name, view);
  }
  return views;
}

inline marrow::Value views_of(const marrow::List<marrow::View>& views) { return shipped::list(views, "view"); }

}  // namespace known_poses
