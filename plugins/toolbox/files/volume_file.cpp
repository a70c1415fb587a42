// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/volume_file.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "header_lines.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "samples.hpp"

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

constexpr float kLeastOfBone = 1200;  ///< in HU + 1024, for the brightest voxel

/// How many of the values lie in a range.
double share(const std::vector<float>& values, float least, float most) {
  const auto count = std::count_if(values.begin(), values.end(), [&](float v) { return v >= least && v <= most; });
  return values.empty() ? 0 : double(count) / double(values.size());
}

bool seems_to_have_offset(const Volume& volume) {
  std::vector<float> above;
  float highest = 0;
  for (const float value : volume.values) {
    if (value < 0) return false;
    if (value > 0) above.push_back(value);
    highest = std::max(highest, value);
  }
  if (highest < kLeastOfBone) return false;
  const double tissue = share(above, 850, 1250);
  const bool is_bone_alone = share(above, 0, 500) < 0.02;
  const bool is_patient = tissue > 0.2 && share(above, 300, 800) < 0.25 * tissue;
  return is_bone_alone || is_patient;
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

void warn_of_offset(const Volume& volume, const std::filesystem::path& path, double value_offset_hu,
                    const Context& context) {
  if (value_offset_hu != 0 || !seems_to_have_offset(volume)) return;
  context.warn(path.string() +
               ": the CT seems to hold HU + 1024, not Hounsfield units: no value is below 0, and soft tissue and bone "
               "lie about 1024 too high. If so, give value_offset_hu: -1024 (-1000 if 1000 was added); without it, "
               "thresholds and simulated X-ray images are wrong");
}

Grid grid_of(const Samples& samples) {
  Grid grid;
  grid.size = samples.size;
  grid.spacing_mm = Eigen::Map<const Eigen::Vector3d>(samples.spacing_mm.data());
  grid.origin_mm = Eigen::Map<const Eigen::Vector3d>(samples.origin_mm.data());
  grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(samples.direction.data());
  const Eigen::Matrix3d defect = grid.direction.transpose() * grid.direction - Eigen::Matrix3d::Identity();
  if (grid.direction.allFinite() && defect.cwiseAbs().maxCoeff() < kRoundedDirection &&
      defect.cwiseAbs().maxCoeff() > 1e-12) {
    grid.direction = nearest_orthogonal(grid.direction);
  }
  return grid;
}

void flip(Volume& volume, int axis) {
  const auto [nx, ny, nz] = volume.grid.size;
  const std::array<int, 3> half{axis == 0 ? nx / 2 : nx, axis == 1 ? ny / 2 : ny, axis == 2 ? nz / 2 : nz};
  for (int z = 0; z < half[2]; ++z)
    for (int y = 0; y < half[1]; ++y)
      for (int x = 0; x < half[0]; ++x)
        std::swap(volume.values[volume.grid.offset(x, y, z)],
                  volume.values[volume.grid.offset(axis == 0 ? nx - 1 - x : x, axis == 1 ? ny - 1 - y : y,
                                                   axis == 2 ? nz - 1 - z : z)]);
}

void make_right_handed(Volume& volume) {
  Grid& grid = volume.grid;
  if (!(grid.direction.determinant() < 0)) return;
  flip(volume, 2);
  grid.origin_mm += grid.direction.col(2) * (grid.spacing_mm[2] * (grid.size[2] - 1));
  grid.direction.col(2) *= -1;
}

}  // namespace marrow::files
