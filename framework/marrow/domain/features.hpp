// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

/// One edge pixel: its sub-pixel position, the unit direction of the gradient (towards brighter pixels), and the
/// gradient's magnitude in grey values per pixel.
struct EdgePixel {
  float u_px = 0, v_px = 0;
  float direction_u = 0, direction_v = 0;
  float magnitude = 0;
  using fields = Fields<&EdgePixel::u_px, &EdgePixel::v_px, &EdgePixel::direction_u, &EdgePixel::direction_v,
                        &EdgePixel::magnitude>;
};

/// The edge pixels of one image, in row-major order of the pixels (round(v), round(u)) to which they belong.
struct EdgeMap {
  int width_px = 0;
  int height_px = 0;
  std::vector<EdgePixel> pixels;
  using fields = Fields<&EdgeMap::width_px, &EdgeMap::height_px, &EdgeMap::pixels>;
};

/// A straight piece of outline in an image. Both ends are pixel positions on the line.
struct LineSegment {
  Eigen::Vector2d from_px = Eigen::Vector2d::Zero();
  Eigen::Vector2d to_px = Eigen::Vector2d::Zero();
  using fields = Fields<&LineSegment::from_px, &LineSegment::to_px>;
};

/// The two outer borders of the shaft in one view. Both have the same direction. Seen from from_px towards to_px in the
/// image (v down), `left` is on the left.
struct ShaftLines {
  LineSegment left;
  LineSegment right;
  double width_mm = 0;            ///< outer diameter, assuming the depth of the isocentre (world origin)
  double width_deviation_mm = 0;  ///< standard deviation, from the error of the fit and the unknown depth
  double log_likelihood = 0;      ///< score of the pair
  /// A rejected pair of borders, with the reason in words. `rejected` begins with the best pair.
  struct Rejected {
    LineSegment left, right;
    std::string reason;
    using fields = Fields<&Rejected::left, &Rejected::right, &Rejected::reason>;
  };
  std::vector<Rejected> rejected;
  using fields = Fields<&ShaftLines::left, &ShaftLines::right, &ShaftLines::width_mm, &ShaftLines::width_deviation_mm,
                        &ShaftLines::log_likelihood, &ShaftLines::rejected>;
};

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
