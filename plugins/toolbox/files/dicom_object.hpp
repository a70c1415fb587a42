// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a DICOM file is, by its header alone.
#include <filesystem>
#include <string>

namespace marrow::files {

struct DicomObject {
  std::filesystem::path path;
  std::string class_uid, series, description, modality;
  std::string not_a_slice;  ///< why it is no slice of a CT: "SR", "a localizer"; empty: it may be one
  bool is_legible = true;   ///< false: its header is damaged before its series is named
};

/// Also of a file that cannot be read as an image, for example because of its transfer syntax.
DicomObject dicom_object(const std::filesystem::path& path);

}  // namespace marrow::files
