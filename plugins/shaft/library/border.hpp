// SPDX-License-Identifier: Apache-2.0
#pragma once
// A border: a straight line in an image with a bright and a dark side, and the edge pixels that support it.
#include <Eigen/Core>
#include <marrow/domain/features.hpp>
#include <utility>
#include <vector>

namespace marrow::shaft {

/// The line {p : normal . p = rho} in pixels. The unit normal points to the brighter side, like the gradient of its
/// edge pixels.
struct Border {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double rho = 0;
  int pixels = 0;        ///< number of edge pixels that support it
  double spread_px = 0;  ///< standard deviation of their distances from the line
};

/// Which edge pixels support a border.
struct Support {
  double tolerance_px = 3;         ///< largest distance from the line
  double direction_cosine = 0.97;  ///< least cosine of the angle between gradient and normal
};

/// An interval along a unit direction: positions s = along . p between `from` and `to`, in pixels.
struct Stretch {
  Eigen::Vector2d along = Eigen::Vector2d::UnitY();
  double from = 0, to = 0;
  double length() const { return to - from; }
};

/// The unit direction of a border.
inline Eigen::Vector2d along(const Border& border) { return {-border.normal.y(), border.normal.x()}; }

/// The point of the line at position s along a direction, which must not be perpendicular to the line.
Eigen::Vector2d point_at(const Border& border, const Eigen::Vector2d& along, double s);

/// Positions along a direction of the edge pixels that support a border, ascending.
std::vector<double> supported_positions(const EdgeMap& edges, const Border& border, const Support& support,
                                        const Eigen::Vector2d& along);

/// First and last position of the run with the most positions and no gap wider than gap_px. Positions must be
/// ascending.
std::pair<double, double> longest_run(const std::vector<double>& positions, double gap_px);

/// Least-squares line through the supporting edge pixels of a stretch. Before it, `weighted` rounds with Tukey's
/// weights reduce the influence of stray pixels. The result has pixels = 0 if fewer than ten are left.
Border refit(const EdgeMap& edges, Border border, const Support& support, const Stretch& stretch, int weighted);

/// The longest stretch in the direction `along` in which both borders have edge pixels side by side, without a gap
/// wider than gap_px. Its length is 0 if there is none. `supported` receives the number of its integer positions at
/// which both borders have an edge pixel.
Stretch common_stretch(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                       const Eigen::Vector2d& along, double gap_px, int& supported);

/// The longest part of a stretch in which neither border has edge pixels of its direction farther outside, between 1.5
/// tolerances and `reach_px` away. If there are such pixels, the border has left the outline and follows the foot of a
/// ridge or another fragment. Runs of them shorter than gap_px do not count.
Stretch stretch_at_outline(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                           const Stretch& stretch, double reach_px, double gap_px);

}  // namespace marrow::shaft
