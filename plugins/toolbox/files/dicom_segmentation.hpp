// SPDX-License-Identifier: Apache-2.0
#pragma once
// DICOM SEG (PS3.3 A.51): the frames of each segment, with their places in the patient.
#include <filesystem>

#include "marrow/toolbox/files/label_file.hpp"

namespace marrow::files {

/// The DICOM SEG that `path` is, or the only one that the folder `path` holds; an empty path if there is none. Throws
/// Error if there are several.
std::filesystem::path dicom_segmentation_in(const std::filesystem::path& path);

/// Reads a segmentation of the types BINARY, FRACTIONAL (at least half of its greatest value is inside) and LABELMAP.
/// Segments that overlap get layers of their own. Slices that no frame shows are empty. Throws Error if the frames do
/// not lie on an even grid, or if the file is damaged or compressed in a way that is not read.
LabelMap read_dicom_segmentation(const std::filesystem::path& path);

}  // namespace marrow::files
