// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which files of a folder are the slices of a CT series.
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::files {

struct SeriesFiles {
  std::vector<std::filesystem::path> slices;  ///< sorted by name
  std::vector<std::string> passed_over;       ///< the other files, each with the reason: "report.dcm (SR)"
};

/// Finds the slices of the series in a folder. Without a `series_uid` the folder must hold only one series that may be
/// a CT. Files that are certainly not slices are skipped. Throws Error if the choice of the series is not clear, or if
/// a file may be a slice but is damaged or in a subfolder. Otherwise the first or last slice could be missed, which
/// leaves no gap.
SeriesFiles files_of_series(const std::filesystem::path& folder, const std::string& series_uid);

}  // namespace marrow::files
