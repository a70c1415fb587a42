// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for cameras: a board with beads on two sides, X-ray files of a C-arm, a chessboard without
// distortion, and a plate of dots in an image that is bent by a known polynomial. Files are written to
// conformance::files_folder().
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/distortion/distortion.hpp"

namespace marrow::conformance {

struct Bead {
  Eigen::Vector3d centre_mm;
  double diameter_mm = 0;
};

/// Two sides of a board, 80 mm apart, with 24 balls each. 6 balls of each side are larger.
const std::vector<Bead>& board_beads();

/// Writes the board to a file (docs/case.md).
std::filesystem::path board_file();
/// Writes where two views, called a and b, show the board's beads. `mirrored`: in an image flipped left to right.
std::filesystem::path points_file(const Camera& a, const Camera& b, bool mirrored);
/// Writes a DICOM XA file: 64 x 48 pixels (columns, rows) of 0.4 x 0.3 mm, 1000 mm from source to detector, 600 mm from
/// source to isocentre.
std::filesystem::path xray_file(const std::string& name, double primary_deg, double secondary_deg);

/// A board with 9 x 6 inner corners and squares of 20 mm, with 2 x 2 samples per pixel. It is turned as the camera's
/// world is. `middle_mm`: its middle in the camera's frame.
Picture chessboard_picture(const Camera& camera, const Eigen::Vector3d& middle_mm);

/// Bright dots, 14 px apart, turned by 10 degrees.
Image plate_image();
distortion::PlatePoints plate_points();
/// The exact distortion.
distortion::Distortion plate_distortion();
/// A list of it and of none at all, as at two poses of the arm.
Value plate_distortions();
/// The largest distance between where a distortion and the exact one see a point. The plate's straight image agrees
/// with the original at its middle, as that of a measured distortion does.
double plate_distance_px(const distortion::Distortion& found);

}  // namespace marrow::conformance
