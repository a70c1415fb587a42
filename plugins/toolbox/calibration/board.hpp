// SPDX-License-Identifier: Apache-2.0
#pragma once
// A calibration board with radio-opaque beads on both sides (docs/case.md describes its file), and where an X-ray image
// shows its beads: dark discs on a background that varies slowly.
#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/calibration/calibrate.hpp"

namespace marrow::calibration {

/// One bead, with its centre in the board's frame. Landmarks are the larger beads; they serve to find a side in an
/// image.
struct Bead {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double diameter_mm = 0;
  int side = 0;
  bool landmark = false;
};

struct Board {
  std::vector<std::string> sides;  ///< two names
  std::vector<Bead> beads;

  /// Indices of the beads of a side: all of them, or only the landmarks.
  std::vector<int> of_side(int side, bool landmarks_only = false) const;
  /// Coordinates of these beads in the plane of a side, in mm along two axes from the mean of the side's beads.
  std::vector<Eigen::Vector2d> flat_mm(int side, const std::vector<int>& indices) const;
};

/// Reads a board. Throws Error if the file cannot be read, or if the beads could not be distinguished in an image or do
/// not determine a camera.
Board read_board_file(const std::filesystem::path& path);

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

/// The beads of the board that are found among the discs of an image (the largest first, from find_beads()). Each side
/// is found separately. Four of the larger discs taken as four landmarks give a projective map; all choices are tried.
/// The map under which most other beads fall on discs is right. Both sides must then fit one camera, which finds the
/// remaining beads. Throws Error, whose text says what is missing.
ViewPoints match_board(const Board& board, const std::vector<BeadImage>& discs, int width_px, int height_px,
                       const std::string& view);

/// Whether a side could be mistaken for the other one or, if `side` equals `other`, for itself turned or mirrored.
bool can_be_mistaken(const Board& board, int side, int other);

}  // namespace marrow::calibration
