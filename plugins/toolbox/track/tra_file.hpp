// SPDX-License-Identifier: Apache-2.0
#pragma once
// Autoscoper's file of a bone's poses (.tra): each line holds the 16 numbers of a frame's 4x4 matrix world from bone,
// row by row, in mm. A frame without a pose is a line of NaN, or of empty cells: commas alone.
#include <filesystem>

#include "marrow/toolbox/track/track_state.hpp"

namespace marrow::track {

/// Skips empty lines. Throws Error if a line does not hold 16 numbers, or if they are no rigid motion. It names the
/// line, and the column of a number that cannot be read.
AutoscoperTrack read_tra_file(const std::filesystem::path& path);

/// The text of such a file, with all digits, so that the same numbers are read back.
std::string tra_text(const AutoscoperTrack& track);

}  // namespace marrow::track
