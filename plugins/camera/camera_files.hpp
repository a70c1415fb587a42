// SPDX-License-Identifier: Apache-2.0
#pragma once
// Test data of the suite for cameras: a board with beads on two sides, and X-ray files of a C-arm. Files are written to
// conformance::files_folder().
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

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

}  // namespace marrow::conformance
