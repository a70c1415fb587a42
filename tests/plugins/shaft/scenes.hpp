// SPDX-License-Identifier: Apache-2.0
#pragma once
// Views and edge maps for tests of the shaft nodes.
#include <gtest/gtest.h>

#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <string>

#include "shipped.hpp"
#include "tests/plugins/edges/radiograph.hpp"

namespace scenes {

/// A test of each node of the kind.
class Shaft : public testing::TestWithParam<std::string> {
 protected:
  std::string node() const { return "shaft." + GetParam(); }
  marrow::ShaftLines find_shaft(const marrow::EdgeMap& edges, const marrow::View& view,
                                const shipped::Options& options = {}) const {
    return shipped::call(node(), {{"edges", shipped::item(edges)}, {"view", shipped::item(view)}}, options,
                         marrow::Context(1))
        .at("lines")
        .as<marrow::ShaftLines>();
  }
};

inline marrow::View empty_view(int size = 512) {
  marrow::View view;
  view.name = "frontal";
  view.camera = radiograph::camera(0, size);
  view.image.pixels = cv::Mat(size, size, CV_16U, cv::Scalar(1000));
  return view;
}

/// A view that is darker between two columns.
inline marrow::View dark_between(int from_u, int to_u) {
  marrow::View view = empty_view();
  view.image.pixels.colRange(from_u, to_u) = 500;
  return view;
}

/// Adds exact edge pixels along a segment, one each pixel, with the bright side towards `bright`.
inline void draw(marrow::EdgeMap& edges, const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                 const Eigen::Vector2d& bright) {
  const Eigen::Vector2d along = (to - from).normalized();
  Eigen::Vector2d normal(-along.y(), along.x());
  if (normal.dot(bright) < 0) normal = -normal;
  for (double s = 0; s <= (to - from).norm(); s += 1) {
    const Eigen::Vector2d p = from + s * along;
    edges.pixels.push_back({float(p.x()), float(p.y()), float(normal.x()), float(normal.y()), 100});
  }
}

inline marrow::EdgeMap no_edges() { return {512, 512, {}}; }
inline const Eigen::Vector2d kLeft(-1, 0), kRight(1, 0);

}  // namespace scenes
