// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

/// Named points of one fragment: anatomical landmarks or implanted markers. Seen and tracked points are matched with
/// the model's points by name.
struct Landmarks {
  /// A point in the frame of the CT.
  struct Point {
    std::string name;
    Eigen::Vector3d model_mm = Eigen::Vector3d::Zero();
    using fields = Fields<&Point::name, &Point::model_mm>;
  };
  /// A point as a view shows it.
  struct Seen {
    std::string name, view;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    double deviation_px = 0;  ///< standard deviation of each coordinate; 0: not known
    using fields = Fields<&Seen::name, &Seen::view, &Seen::pixel, &Seen::deviation_px>;
  };
  /// A point as a tracking system measured it, in world coordinates.
  struct Tracked {
    std::string name;
    Eigen::Vector3d world_mm = Eigen::Vector3d::Zero();
    using fields = Fields<&Tracked::name, &Tracked::world_mm>;
  };
  std::vector<Point> points;
  std::vector<Seen> seen;
  std::vector<Tracked> tracked;
  using fields = Fields<&Landmarks::points, &Landmarks::seen, &Landmarks::tracked>;
};

}  // namespace marrow
