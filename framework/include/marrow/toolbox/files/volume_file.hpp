// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/image.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

/// What a file does not say of itself.
struct VolumeReading {
  std::vector<double> voxel_size_mm;  ///< 3 numbers, or none: as the file says
  std::vector<std::string> flip;      ///< axes of the grid (x, y, z) along which the samples are reversed
  double value_offset_hu = 0;         ///< added to every sample
  std::string series_uid;             ///< of DICOM; empty: the only one
};

/// A CT volume from MHA, NRRD, NIfTI, multi-page TIFF, or a folder: a DICOM series, or an MHD or NHDR header with the
/// file that it names. Patient axes are LPS. Throws Error.
Volume read_volume_file(const std::filesystem::path& path, const VolumeReading& reading);

/// One grey image from PNG or TIFF, with 8 or 16 bits or float, or from DICOM. That of an X-ray file (XA, RF) is turned
/// to what the camera of its header sees: mirrored where it is stored as one facing the patient sees it, and bright =
/// air. `frame` counts from 1; 0 = there must be only one. Throws Error.
Image read_image_file(const std::filesystem::path& path, int frame = 0);

/// Whether read_image_file() mirrors this image, so that what was drawn on the file as it is stored must be mirrored
/// along.
bool is_mirrored_as_read(const std::filesystem::path& path, int frame = 0);

}  // namespace marrow::files
