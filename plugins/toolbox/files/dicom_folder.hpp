// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a DICOM file is, by its header alone, and which files of a folder are the slices of a CT series.
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

struct DicomObject {
  std::filesystem::path path;
  std::string class_uid, series, description, modality;
  std::string not_a_slice;  ///< why it is not a CT slice: "SR", "a localizer"; empty: it may be one
  bool is_legible = true;   ///< false: its header is damaged before its series is named
};

/// Also works for files that cannot be read as images, for example because of their transfer syntax.
DicomObject dicom_object(const std::filesystem::path& path);

}  // namespace marrow::files
