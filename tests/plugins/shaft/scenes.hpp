// SPDX-License-Identifier: Apache-2.0
#pragma once
// Views and edge maps for tests of the shaft nodes.
#include "tests/plugins/edges/radiograph.hpp"

namespace marrow::test::scenes {

/// A test of each node of the kind.
class Shaft : public testing::TestWithParam<std::string> {
 protected:
  std::string node() const { return "shaft." + GetParam(); }
  ShaftLines find_shaft(const EdgeMap& edges, const View& view, const Options& options = {}) const {
    return output<ShaftLines>(node(), "lines", {{"edges", item(edges)}, {"view", item(view)}}, options, Context(1));
  }
};

inline View empty_view(int size = 512) {
  return view_of("frontal", radiograph::camera(0, size), cv::Mat(size, size, CV_16U, cv::Scalar(1000)));
}

/// A view that is darker between two columns.
inline View dark_between(int from_u, int to_u) {
  View view = empty_view();
  view.image.pixels.colRange(from_u, to_u) = 500;
  return view;
}

/// Adds exact edge pixels along a segment, one each pixel, with the bright side towards `bright`.
inline void draw(EdgeMap& edges, const Vector2d& from, const Vector2d& to, const Vector2d& bright) {
  const Vector2d along = (to - from).normalized();
  Vector2d normal(-along.y(), along.x());
  if (normal.dot(bright) < 0) normal = -normal;
  for (double s = 0; s <= (to - from).norm(); s += 1) {
    const Vector2d p = from + s * along;
    edges.pixels.push_back({float(p.x()), float(p.y()), float(normal.x()), float(normal.y()), 100});
  }
}

inline EdgeMap no_edges() { return {512, 512, {}}; }
inline const Vector2d kLeft(-1, 0), kRight(1, 0);

}  // namespace marrow::test::scenes
