// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the suite of cameras lays before the nodes: a board with beads on two sides, and X-ray files of a C-arm. Files
// are written to conformance::files_folder().
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"

namespace marrow::conformance {

struct Bead {
  Eigen::Vector3d centre_mm;
  double diameter_mm = 0;
};

/// 24 balls on either side of a board, 80 mm apart, 6 of each side larger.
const std::vector<Bead>& board_beads();

/// The board in a file (docs/case.md).
std::filesystem::path board_file();
/// Where these views, called a and b, show the board's beads; `mirrored` as an image shows them that is turned left to
/// right.
std::filesystem::path points_file(const Camera& a, const Camera& b, bool mirrored);
/// An XA file of the DICOM standard: 64 x 48 pixels of 0.4 x 0.3 mm (columns, rows), source to detector 1000 mm, to the
/// isocentre 600 mm.
std::filesystem::path xray_file(const std::string& name, double primary_deg, double secondary_deg);

}  // namespace marrow::conformance
