// SPDX-License-Identifier: Apache-2.0
#pragma once
// Poses beside a truth, and views that see them, for figures that a hand can compute.
#include "tests/harness/node_test.hpp"

namespace marrow::test::known_poses {

/// The truth of all tests: CT coordinates are the world's.
inline Value exact() { return item(Truth()); }

inline Value tool_box() { return item(box({0, 0, 0}, {20, 30, 60})); }

/// One landmark at the origin.
inline Value origin() {
  Landmarks landmarks;
  landmarks.points = {{"origin", {0, 0, 0}}};
  return item(landmarks);
}

/// Views "frontal", which looks along +y, and "lateral", along -x, at the origin from 600 mm, with a focal length of
/// 2000 px: a pixel is 0.3 mm there.
inline List<View> two_views() {
  Camera frontal = before_origin(pinhole(2000, 512, 512, {{256, 256}}), 600), lateral = frontal;
  frontal.camera_from_world.rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  lateral.camera_from_world.rotation << 0, 1, 0, 0, 0, -1, -1, 0, 0;
  return views_named(view_of("frontal", frontal), view_of("lateral", lateral));
}

}  // namespace marrow::test::known_poses
