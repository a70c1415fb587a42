// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/image.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::files {

/// Information that replaces or completes what a file says.
struct VolumeReading {
  std::vector<double> voxel_size_mm;  ///< 3 numbers; empty: as the file says
  std::vector<std::string> flip;      ///< axes of the grid (x, y, z) along which the samples are reversed
  double value_offset_hu = 0;         ///< added to every sample
  std::string series_uid;             ///< of a DICOM series; empty: there must be only one
};

/// Reads a CT volume from MHA, NRRD, NIfTI, multi-page TIFF, or a folder. A folder holds a DICOM series, or an MHD or
/// NHDR header with the file that it names. Patient axes are LPS. A left-handed grid is made right-handed; each voxel
/// keeps its value and its position. Throws Error if the file is damaged or not supported, if its voxel size is
/// unknown, or if check_volume() refuses the volume.
Volume read_volume_file(const std::filesystem::path& path, const VolumeReading& reading);

/// Reads one grey image from PNG, TIFF (8 or 16 bits, or float) or DICOM. An X-ray image (XA, RF) is returned as the
/// camera of its header sees it: it is mirrored back if it was stored as an observer facing the patient sees it, and
/// inverted if air is dark in it. `frame` counts from 1; 0: there must be only one. Throws Error if the file is damaged
/// or not supported, has no such frame, or has more than one channel.
Image read_image_file(const std::filesystem::path& path, int frame = 0);

/// The image with its columns (left_right) or rows (upside_down) in reverse order; as it is for "none".
Image turned_over(Image image, const std::string& mirror);

/// Whether read_image_file() mirrors this image. If so, drawings made on the stored file must be mirrored too.
bool is_mirrored_as_read(const std::filesystem::path& path, int frame = 0);

}  // namespace marrow::files
