// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
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
  std::string series_uid;             ///< of a DICOM series; empty: there must be only one CT
};

/// Reads a CT volume from MHA, NRRD, NIfTI, multi-page TIFF (the content tells which), or a folder. A folder holds a
/// DICOM series, or an MHD or NHDR header with the file that it names. Patient axes are LPS. A left-handed grid is made
/// right-handed; each voxel keeps its value and its position. Throws Error if the file is damaged or not supported, if
/// its voxel size is unknown, or if check_volume() refuses the volume. `tell` is given a line for the log that names
/// the files of a folder which were passed over.
Volume read_volume_file(const std::filesystem::path& path, const VolumeReading& reading,
                        const std::function<void(const std::string&)>& tell = {});

/// Reads one grey image from PNG, TIFF, JPEG, BMP, DICOM, or a file for volumes (MetaImage, NRRD, NIfTI). The content
/// tells the format, not the file's name. Grey levels of 8 and 16 bits without sign are kept, all others become float.
/// Colours must be equal. In a file for volumes the first axis is a row and the second a column, wherever its header
/// puts them. An X-ray image (XA, RF) is returned as the camera of its header sees it: it is mirrored back if it was
/// stored as an observer facing the patient sees it, and inverted if air is dark in it. `frame` counts from 1; 0: there
/// must be only one. Throws Error if the file is damaged or not supported, has no such frame, or has colours.
Image read_image_file(const std::filesystem::path& path, int frame = 0);

/// The image with its columns (left_right) or rows (upside_down) in reverse order; as it is for "none".
Image turned_over(Image image, const std::string& mirror);

/// Whether read_image_file() mirrors this image. If so, drawings made on the stored file must be mirrored too.
bool is_mirrored_as_read(const std::filesystem::path& path, int frame = 0);

}  // namespace marrow::files
