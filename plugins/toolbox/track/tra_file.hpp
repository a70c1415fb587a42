// SPDX-License-Identifier: Apache-2.0
#pragma once
// Autoscoper's file of a bone's poses (.tra): a line a frame, the 16 numbers of the 4x4 matrix world from bone row by
// row, in mm. A frame without a pose is a line of NaN, or of empty cells: commas alone.
#include <filesystem>

#include "marrow/toolbox/track/track_state.hpp"

namespace marrow::track {

/// Empty lines do not count. Throws Error with the line, and with the column where a number cannot be read, if a line
/// is not 16 numbers or no rigid motion.
AutoscoperTrack read_tra_file(const std::filesystem::path& path);

/// The text of such a file, with all digits, so that the same numbers are read back.
std::string tra_text(const AutoscoperTrack& track);

}  // namespace marrow::track
