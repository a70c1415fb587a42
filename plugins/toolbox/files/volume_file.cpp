// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/volume_file.hpp"

#include <algorithm>
#include <cmath>

#include "file_format.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "samples.hpp"
#include "volume_grid.hpp"

namespace marrow::files {
namespace {

namespace fs = std::filesystem;

VolumeSamples read_tiff_volume(const fs::path& path) {
  VolumeSamples volume{read_tiff(path), {}};
  if (volume.geometry.components != 1)
    throw Error(formatted("{}: has {} values per voxel; a CT has one", path.string(), volume.geometry.components));
  if (!volume.geometry.other_pages.empty())
    throw Error(path.string() + ": is " + volume.geometry.other_pages +
                ", whose pages are not slices of one volume; save one of them alone, or, where they are slices, save "
                "them as such (in ImageJ: Image, Properties)");
  volume.values = to_float(volume.geometry);
  volume.geometry.bytes = {};
  return volume;
}

[[noreturn]] void refuse_as_volume(const fs::path& path, FileFormat format) {
  const std::string other = format == FileFormat::unknown ? name_of_other_format(path) : "a picture (PNG, JPEG or BMP)";
  throw Error(path.string() + ": " + (other.empty() ? "" : "is " + other + ", ") +
              "not a volume that can be read; known are .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .tif and a "
              "folder of DICOM slices (name the folder)");
}

/// `folder_is_named`: the user named the folder of the file, so other files in it are part of the input.
VolumeSamples read_single(const fs::path& path, FileFormat format, bool folder_is_named) {
  if (format == FileFormat::meta_image) return read_meta_image(path, folder_is_named);
  if (format == FileFormat::nrrd) return read_nrrd(path, folder_is_named);
  if (format == FileFormat::nifti) return read_nifti(path);
  if (format == FileFormat::tiff) return read_tiff_volume(path);
  if (format == FileFormat::dicom) return read_dicom_frames(path);
  refuse_as_volume(path, format);
}

/// The MHD or NHDR header in the folder; an empty path if there is none. Throws Error if there are several, or if DICOM
/// files lie beside it: names do not say which of the two is the CT and which are its labels.
fs::path detached_header_in(const fs::path& folder) {
  std::vector<fs::path> headers, others;
  std::error_code failure, none;
  for (fs::directory_iterator entry(folder, failure), end; entry != end && !failure; entry.increment(failure)) {
    const std::string extension = extension_of(entry->path());
    const bool is_header = extension == ".mhd" || extension == ".nhdr";
    if (is_header || entry->is_regular_file(none)) (is_header ? headers : others).push_back(entry->path());
  }
  if (failure) throw Error(folder.string() + ": cannot be read (" + failure.message() + ")");
  if (!headers.empty())
    for (const fs::path& other : others)
      if (looks_like_dicom(other))
        throw Error(folder.string() + ": holds both a DICOM file ('" + other.filename().string() + "') and '" +
                    headers[0].filename().string() + "', which may be another volume; keep one volume per folder");
  if (headers.size() > 1)
    throw Error(formatted("{}: holds {} .mhd or .nhdr files; keep one per folder", folder.string(), headers.size()));
  if (headers.empty()) return {};
  check_stays_inside(folder, headers[0]);
  return headers[0];
}

int axis_of(const std::string& name) {
  static const std::string kAxes = "xyz";
  if (name.size() != 1 || kAxes.find(name) == std::string::npos)
    throw Error("flip: expected axes x, y or z, got '" + name + "'");
  return int(kAxes.find(name));
}

void check_reading(const VolumeReading& reading) {
  if (!reading.voxel_size_mm.empty() && reading.voxel_size_mm.size() != 3)
    throw Error(formatted("voxel_size_mm: expected 3 lengths, got {}", reading.voxel_size_mm.size()));
  for (double length : reading.voxel_size_mm)
    if (!(length > 0) || !std::isfinite(length))
      throw Error(formatted("voxel_size_mm: expected positive lengths, got {:f}", length));
}

}  // namespace

Volume read_volume_file(const fs::path& path, const VolumeReading& reading,
                        const std::function<void(const std::string&)>& tell) {
  check_reading(reading);
  std::error_code failure;
  if (!fs::exists(path, failure)) throw Error(path.string() + ": there is no such file or folder");
  const bool is_folder = fs::is_directory(path, failure);
  const fs::path file = is_folder ? detached_header_in(path) : path;
  const FileFormat format = file.empty() ? FileFormat::dicom : file_format(file);
  VolumeSamples samples =
      file.empty() ? read_dicom_series(path, reading.series_uid) : read_single(file, format, is_folder);
  if (tell && !samples.note.empty()) tell(samples.note);
  if (samples.geometry.dimensions < 3)
    throw Error(formatted("{}: is one image, not a volume; expected 3 dimensions, got {}", file.string(),
                          samples.geometry.dimensions));
  if (format == FileFormat::tiff && reading.voxel_size_mm.empty())
    throw Error(file.string() + ": a TIFF does not say how large its voxels are; give voxel_size_mm: [x, y, z]");
  if (!samples.geometry.spacing_field.empty() && reading.voxel_size_mm.empty())
    throw Error(file.string() + ": its header does not say how large its voxels are; add '" +
                samples.geometry.spacing_field + "' (mm) to it, or give voxel_size_mm: [x, y, z]");
  Volume volume{grid_of(samples.geometry), std::move(samples.values)};
  for (std::size_t k = 0; k < reading.voxel_size_mm.size(); ++k) volume.grid.spacing_mm[k] = reading.voxel_size_mm[k];
  for (const std::string& axis : reading.flip) flip(volume, axis_of(axis));
  make_right_handed(volume);
  if (reading.value_offset_hu != 0)
    for (float& value : volume.values) value = float(value + reading.value_offset_hu);
  check_volume(volume, path.string());
  return volume;
}

}  // namespace marrow::files
