// SPDX-License-Identifier: Apache-2.0
#pragma once
// A border: a straight line in an image with a bright and a dark side, and the edge pixels that support it.
#include <Eigen/Core>
#include <marrow/domain/features.hpp>
#include <utility>
#include <vector>

namespace marrow::shaft {

/// The line {p : normal . p = rho}; the unit normal points to the brighter side, as the gradient of its edge pixels
/// does.
struct Border {
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();
  double rho = 0;
  int pixels = 0;        ///< that support it
  double spread_px = 0;  ///< standard deviation of their distances from the line
};

/// Which edge pixels support a border.
struct Support {
  double tolerance_px = 3;         ///< largest distance from the line
  double direction_cosine = 0.97;  ///< least cosine between gradient and normal
};

/// A stretch of a direction: positions s = along . p between `from` and `to`.
struct Stretch {
  Eigen::Vector2d along = Eigen::Vector2d::UnitY();
  double from = 0, to = 0;
  double length() const { return to - from; }
};

/// The direction of a border, as its own `along`.
inline Eigen::Vector2d along(const Border& border) { return {-border.normal.y(), border.normal.x()}; }

/// Where the line stands at position s along a direction that is not across it.
Eigen::Vector2d point_at(const Border& border, const Eigen::Vector2d& along, double s);

/// Positions along a direction of the edge pixels that support a border, ascending.
std::vector<double> supported_positions(const EdgeMap& edges, const Border& border, const Support& support,
                                        const Eigen::Vector2d& along);

/// The stretch of most positions without a gap wider than gap_px; the positions must ascend.
std::pair<double, double> longest_run(const std::vector<double>& positions, double gap_px);

/// Least squares line through the supporting edge pixels of a stretch. Rounds of `weighted` refits with Tukey's weights
/// come first, so that stray pixels lose their pull. The border given back has no pixels when fewer than ten are left.
Border refit(const EdgeMap& edges, Border border, const Support& support, const Stretch& stretch, int weighted);

/// The longest stretch, in the direction `along`, in which both borders have edge pixels side by side without a gap
/// wider than gap_px; of zero length when there is none. `supported` receives the number of whole pixels of it at which
/// both have one.
Stretch common_stretch(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                       const Eigen::Vector2d& along, double gap_px, int& supported);

/// The longest part of a stretch in which neither border has edge pixels of its direction outside of it, between 1.5
/// tolerances and `reach_px` away: where there are, the border has run on inside the outline, from a ridge's foot or
/// from another fragment. Shorter runs of them than gap_px do not count.
Stretch stretch_at_outline(const EdgeMap& edges, const Border& one, const Border& other, const Support& support,
                           const Stretch& stretch, double reach_px, double gap_px);

}  // namespace marrow::shaft
