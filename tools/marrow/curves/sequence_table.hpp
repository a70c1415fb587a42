// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <limits>

#include "curves/recording.hpp"

namespace marrow::cli {

inline constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

/// A table whose rows are frames.
struct SequenceTable {
  Times times;
  std::vector<std::string> frame_names;  ///< of the column `name`; may be empty
  std::vector<FigureOverTime> figures;
  std::optional<PosesOverTime> poses;
};

/// Reads a CSV file with a header. `name` is the first part of the names of what it holds. Without a column `frame`,
/// rows are counted from 1. The table is empty if the file has neither that column nor `time_s`. Throws Error if the
/// frames or times are no rising numbers, or a row is shorter than the header. It names the line.
SequenceTable read_sequence_table(const std::filesystem::path& path, const std::string& name);

}  // namespace marrow::cli
