// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a DICOM file is, by its header alone.
#include <filesystem>
#include <string>

namespace marrow::files {

struct DicomObject {
  std::filesystem::path path;
  std::string class_uid, series, description, modality;
  std::string not_a_slice;  ///< why it is not a CT slice: "SR", "a localizer"; empty: it may be one
  bool is_legible = true;   ///< false: its header is damaged before its series is named
};

/// Also works for files that cannot be read as images, for example because of their transfer syntax.
DicomObject dicom_object(const std::filesystem::path& path);

}  // namespace marrow::files
