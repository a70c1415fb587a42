// SPDX-License-Identifier: Apache-2.0
#pragma once
// Matching: which dark disc of an image is which bead of the board.
#include "marrow/toolbox/calibration/beads.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/calibration/calibrate.hpp"

namespace marrow::calibration {

/// The beads of the board that are found among the discs of an image (the largest first, from find_beads()). Each side
/// is found separately. Four of the larger discs taken as four landmarks give a projective map; all choices are tried.
/// The map under which most other beads fall on discs is right. Both sides must then fit one camera, which finds the
/// remaining beads. Throws Error, whose text says what is missing.
ViewPoints match_board(const Board& board, const std::vector<BeadImage>& discs, int width_px, int height_px,
                       const std::string& view);

/// Whether a side could be mistaken for the other one or, if `side` equals `other`, for itself turned or mirrored.
bool can_be_mistaken(const Board& board, int side, int other);

}  // namespace marrow::calibration
