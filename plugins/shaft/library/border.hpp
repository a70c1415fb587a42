// SPDX-License-Identifier: Apache-2.0
#pragma once
// A border: a straight line in an image with a bright and a dark side, and the edge pixels that support it.
#include <marrow/domain/features.hpp>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

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

// The brightness of the image at a pair of borders: bone is darker than its surroundings along its whole length.

/// Mean grey values inside a pair, and in strips from 1 to 4 mm outside its borders. A region outside the image has the
/// value infinity, which never contradicts bone.
struct Brightness {
  double inside = 0, outside_left = 0, outside_right = 0;
};
Brightness brightness_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                         double pixel_mm);

/// The step of brightness at a pair of borders. For each border it is the mean of (outside - inside) / (outside +
/// inside) along the stretch, at least 0. The result is the geometric mean of both borders.
double step_of(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch, double pixel_mm);

/// The longest part of a stretch in which the image darkens across both borders, each by at least 0.3 of `bone_step`,
/// the step of this image's bone. Borders of muscle and fat are fainter than that. Where a bowed bone leaves the line,
/// there is no step. Interruptions shorter than `gap_px` do not count. The length is 0 if there is no such part.
Stretch stretch_with_steps(const cv::Mat& image, const Border& left, const Border& right, const Stretch& stretch,
                           double bone_step, double pixel_mm, double gap_px);

// Finds the outline of a round bone from its edges.

/// Distance in pixels, along a border's normal, from the edge pixels of a stretch to the bone's outline. The
/// attenuation of a round bone begins with a vertical tangent at its outline. Blur, by the detector and by the edge
/// extractor, moves its steepest point inwards by about three quarters of the blur's standard deviation. So the profile
/// across the border is fitted with the blurred chord of a cylinder of this width; position and blur are free.
/// std::nullopt if this does not fit: the best position is at the end of the range that is tried (as at a ridge), the
/// attenuation does not increase inwards, or there are too few edge pixels.
std::optional<double> outline_beyond_edges_px(const cv::Mat& image, const EdgeMap& edges, const Border& border,
                                              const Support& support, const Stretch& stretch, double width_px,
                                              double pixel_mm);

}  // namespace marrow::shaft
