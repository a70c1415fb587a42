// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/runtime/node/context.hpp"

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

/// Warns if a CT that was read with this `value_offset_hu` from `path` seems to hold HU + 1024, or + 1000, and not
/// Hounsfield units. No value of such a CT is below 0. If it holds a bone alone, hardly any value above 0 lies below
/// 500. If it holds a whole patient, soft tissue lies about 1024, and hardly any value lies between that and air. An
/// offset that was given, or a map of labels, whose values stay far below those of bone, raises no doubt.
void warn_of_offset(const Volume& volume, const std::filesystem::path& path, double value_offset_hu,
                    const Context& context);

/// Sentences for the user if it is doubtful that read_image_file() returns the image as it is seen from the source.
/// Either the image was flipped after it was taken, and the header does not say how the patient lies in it. Or the
/// header says how the patient lies in it, but not from where it was taken. Empty for other files and headers. `frame`
/// counts from 1; 0 is taken as 1.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame = 0);

/// The same for a camera whose world has the patient's axes, as those of `c_arm`. Then the header's PatientOrientation
/// decides: one sentence if this camera would see the image mirrored, else none.
std::vector<std::string> doubts_about_sides(const std::filesystem::path& image, int frame, const Camera& camera);

/// Whether an image was compressed with loss: it is a JPEG, or a DICOM file whose pixels are or were one.
bool is_lossy_image(const std::filesystem::path& image);

/// Warns where the file's format gives a reason to doubt the pixels that read_image_file() returns: they were
/// compressed with loss, or the format does not say which row is the upper one. Each warning begins with the path.
void warn_of_pixels(const std::filesystem::path& image, const Context& context);

}  // namespace marrow::files
