// SPDX-License-Identifier: Apache-2.0
#pragma once
// Spots in an image that may be dots or holes of a plate: bright or dark, of one size.
#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <vector>

namespace marrow::distortion {

/// A spot, and how much it stands out from its surroundings, in grey values. `roundness` is the smaller curvature of
/// its peak divided by the larger one; a dot that the border of the field cuts is not round.
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

}  // namespace marrow::distortion
