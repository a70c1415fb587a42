// SPDX-License-Identifier: Apache-2.0
#pragma once
// A planar plate with a regular grid of dots or holes in an image, and where a straight image would show its dots.
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::distortion {

/// A spot in an image that may be a dot or hole of a plate, and how much it stands out from its surroundings, in grey
/// values. `roundness` is the smaller curvature of its peak divided by the larger one; a dot that the border of the
/// field cuts is not round.
struct Spot {
  Eigen::Vector2d at_px = Eigen::Vector2d::Zero();
  double strength = 0, roundness = 1;
};

/// All spots whose radius is about `radius_px`, the most central first. A spot is a maximum of the difference of two
/// Gaussians (Lowe, IJCV 2004, section 3), which no slow change of brightness moves. It must stand out from what is
/// usual in its neighbourhood. At most 20,000 are given. `grey` must be finite.
std::vector<Spot> find_spots(const cv::Mat1f& grey, double radius_px, bool is_bright);

/// Finds which spots lie near a place.
class NearbySpots {
 public:
  /// `cell_px` is about the distance between spots. The spots must outlive this.
  NearbySpots(const std::vector<Spot>& spots, double cell_px);

  /// The index of the nearest spot within the reach, or -1.
  int nearest(const Eigen::Vector2d& place, double reach_px) const;
  /// Indices of all spots within the reach, by their distance.
  std::vector<int> within(const Eigen::Vector2d& place, double reach_px) const;

 private:
  std::pair<int, int> cell_of(const Eigen::Vector2d& place) const;

  const std::vector<Spot>& spots_;
  double cell_px_;
  int columns_ = 0, rows_ = 0;
  std::vector<std::vector<int>> cells_;
};

/// square: rows and columns. hexagonal: each dot has six neighbours.
enum class Pattern { square, hexagonal };

/// A dot of the plate: its column and row in the grid, counted from any dot, and the spot that shows it. In a hexagonal
/// grid the rows are the lines at 60 degrees.
struct GridDot {
  int column = 0, row = 0, spot = 0;
};

/// Where a dot is on the plate, in units of the distance between neighbours. Rows and columns go round as u and v do.
Eigen::Vector2d place_on_plate(Pattern grid, int column, int row);

/// The largest part of the spots that is a grid. It grows from a dot to its neighbours, over single missing dots, and
/// then to dots beside known ones where a polynomial through all others expects them. Parts that an instrument
/// separates are joined where a polynomial through both tells how their rows continue, and left out elsewhere. A plate
/// may be turned, mirrored and tilted by up to 45 degrees. Empty if fewer than nine spots are a grid, or if neighbours
/// do not confirm it.
std::vector<GridDot> find_grid(const std::vector<Spot>& spots, Pattern grid);

/// The distance between neighbours: the median over the dots.
double spacing_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid);

/// How exactly the dots were located, as far as neighbours tell: the median distance of a dot from the middle of two
/// opposite neighbours. A smooth distortion hardly changes it.
double unevenness_px(const std::vector<Spot>& spots, const std::vector<GridDot>& dots, Pattern grid);

/// How a tilted plate would look without distortion.
struct PlateTilt {
  std::vector<Eigen::Vector2d> places;  ///< of the dots, in pixels, up to place, turn and size
  double perspective_px = 0;            ///< by which perspective moves what lies half an image from the middle
  double deviation_px = 0;              ///< standard deviation of that

  /// Three deviations or more.
  bool is_certain() const { return perspective_px > 3 * deviation_px; }
};

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
