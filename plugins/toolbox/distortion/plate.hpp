// SPDX-License-Identifier: Apache-2.0
#pragma once
// A planar plate with a regular grid of dots or holes in an image, and where a straight image would show its dots.
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/image.hpp"
#include "marrow/toolbox/distortion/plate_dots.hpp"
#include "marrow/toolbox/distortion/plate_grid.hpp"
#include "marrow/toolbox/distortion/plate_points.hpp"
#include "marrow/toolbox/distortion/plate_tilt.hpp"

namespace marrow::distortion {

struct PlateSearch {
  std::optional<Pattern> grid;    ///< nothing: the one of which more dots are found
  std::optional<bool> is_bright;  ///< nothing: likewise
  double dot_px = 0;              ///< diameter of a dot in the image; 0: sizes from 2 px on are tried
};

/// The dots of a plate in an image.
struct PlateImage {
  Pattern grid = Pattern::square;
  bool is_bright = true;
  double dot_px = 0;  ///< the diameter at which dots were located best
  std::vector<Spot> spots;
  std::vector<GridDot> dots;
  std::vector<bool> is_whole;  ///< of each dot: not cut by the border of the field or by an instrument
};

/// Finds the plate. If a size, a sign or a grid is not given, all are tried: the most dots win; among those with nearly
/// as many, the ones that neighbours confirm best. Throws Error if the image is empty, has colours, is not finite or
/// shows fewer than `least_dots` dots of a grid.
PlateImage find_plate(const Image& image, const PlateSearch& search, std::size_t least_dots);

/// What the straight image has in common with the original near its middle. A plate does not tell where the camera is,
/// so one of these is chosen.
///
/// automatic: place, turn and size. If the distortion tells for certain that the plate is tilted (tilt_of()), its
/// perspective is no distortion.
/// similarity: place, turn and size. The plate is parallel to the detector, as one on the intensifier's face is.
/// affine: also its different sizes along two directions: as if the plate were tilted a little.
/// homography: the plate is tilted, and its perspective, as the whole image tells it, is no distortion.
enum class Straight { automatic, similarity, affine, homography };

/// Where a straight image shows the dots.
struct StraightPlate {
  PlatePoints points;
  double pixels_per_spacing = 0;  ///< in the straight image
  double stretch = 1;  ///< by which the image's middle is longer along one direction than along the other, at least 1
  PlateTilt tilt;      ///< what the distortion tells of it; nothing for `homography`
  bool is_tilted = false;  ///< the perspective of `tilt` was taken
};

/// The straight image shows the point at the image's middle where the original does, and around it the plate as the
/// original does, as far as `straight` says. If the plate does not reach the middle, its dot nearest to the middle
/// counts. Dots that something cuts are not used. `width_px` and `height_px` are of the image.
StraightPlate straight_plate(const PlateImage& plate, Straight straight, int width_px, int height_px);

/// The share of an area that lies within `reach_px` of a point. `area` is CV_8U, non-zero inside.
double covered_share(const std::vector<Eigen::Vector2d>& points, double reach_px, const cv::Mat1b& area);

/// The part of the image that the beam reaches: non-zero where the image, with everything closed that is narrower than
/// `width_px`, is brighter than a quarter of its 95th percentile, above the darkest.
cv::Mat1b field_of(const Image& image, double width_px);

}  // namespace marrow::distortion
