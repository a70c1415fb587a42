// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which dark disc of an image is which bead of the board.
#include "marrow/toolbox/calibration/beads.hpp"
#include "marrow/toolbox/calibration/board.hpp"
#include "marrow/toolbox/calibration/calibrate.hpp"

namespace marrow::calibration {

/// The beads of the board that are found among the discs of an image. Each side is found by itself: every way to take
/// four of the larger discs for its landmarks gives a projective map, and the one under which most other beads fall on
/// discs is right. Both sides then have to fit one camera, which finds the rest. Throws Error that says what is
/// missing.
ViewPoints match_board(const Board& board, const std::vector<BeadImage>& discs, int width_px, int height_px,
                       const std::string& view);

/// True where a side could be taken for another, or for itself with its landmarks exchanged.
bool can_be_mistaken(const Board& board, int side, int other);

}  // namespace marrow::calibration
