// SPDX-License-Identifier: Apache-2.0
#pragma once
// Beads in an X-ray image: dark discs on a background that varies slowly.
#include <Eigen/Core>
#include <vector>

#include "marrow/domain/image.hpp"

namespace marrow::calibration {

struct BeadSearch {
  double largest_px = 0;      ///< diameter of the largest bead; 0: a sixteenth of the image's width
  double min_contrast = 0.2;  ///< contrast of the faintest bead as a fraction of that of the darkest
};

/// The dark disc of one bead. The image of a sphere is an ellipse. Its centre is not exactly the image of the sphere's
/// centre, but for beads (2 mm at 600 mm) the difference is below 0.01 px.
struct BeadImage {
  Eigen::Vector2d centre_px = Eigen::Vector2d::Zero();
  double diameter_px = 0;
  double contrast = 0;  ///< by how many grey values it is darker than its surroundings
};

/// All round dark discs, the largest first. Discs that touch the border, merge with another one or are not round are
/// left out. Throws Error if the image is empty or does not have one channel.
std::vector<BeadImage> find_beads(const Image& image, const BeadSearch& search);

}  // namespace marrow::calibration
