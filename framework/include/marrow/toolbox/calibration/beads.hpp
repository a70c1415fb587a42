// SPDX-License-Identifier: Apache-2.0
#pragma once
// Beads in an X-ray image: dark discs on a background that varies slowly.
#include <Eigen/Core>
#include <vector>

#include "marrow/domain/image.hpp"

namespace marrow::calibration {

struct BeadSearch {
  double largest_px = 0;        ///< diameter of the largest bead; 0: a sixteenth of the image's width
  double least_contrast = 0.2;  ///< darkness of the faintest bead, as a fraction of the darkest
};

/// The dark disc of one bead. A sphere's image is an ellipse whose centre is not the image of the sphere's centre, but
/// for beads (2 mm at 600 mm) the difference is below 0.01 px.
struct BeadImage {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double diameter_px = 0;
  double contrast = 0;  ///< how much darker than its surroundings
};

/// All round dark discs, the largest first. What touches the border, merges with another, or is not round is left out.
std::vector<BeadImage> find_beads(const Image& image, const BeadSearch& search);

}  // namespace marrow::calibration
