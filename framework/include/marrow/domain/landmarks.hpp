// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <tuple>
#include <vector>

namespace marrow {

/// Points of one fragment that can be told apart: anatomical landmarks or implanted markers, by their names. What is
/// seen or tracked is matched with the model's points by name.
struct Landmarks {
  /// A point in the frame of the CT.
  struct Point {
    std::string name;
    Eigen::Vector3d model_mm = Eigen::Vector3d::Zero();
    static constexpr auto fields() { return std::make_tuple(&Point::name, &Point::model_mm); }
  };
  /// Where a view shows a point.
  struct Seen {
    std::string name, view;
    Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
    static constexpr auto fields() { return std::make_tuple(&Seen::name, &Seen::view, &Seen::pixel); }
  };
  /// Where a tracking system found a point, in the world.
  struct Tracked {
    std::string name;
    Eigen::Vector3d world_mm = Eigen::Vector3d::Zero();
    static constexpr auto fields() { return std::make_tuple(&Tracked::name, &Tracked::world_mm); }
  };
  std::vector<Point> points;
  std::vector<Seen> seen;
  std::vector<Tracked> tracked;
  static constexpr auto fields() { return std::make_tuple(&Landmarks::points, &Landmarks::seen, &Landmarks::tracked); }
};

}  // namespace marrow
