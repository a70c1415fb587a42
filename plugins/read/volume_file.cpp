// SPDX-License-Identifier: Apache-2.0
#include "volume_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>

#include "marrow/domain/error.hpp"
#include "samples.hpp"
#include "xray_header.hpp"

namespace marrow::read {
namespace {

namespace fs = std::filesystem;

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return extension;
}

/// The file that a detached header (MHD, NHDR) names for its samples; empty when they are in the header's own file.
std::string detached_data(const fs::path& header) {
  std::ifstream stream(header, std::ios::binary);
  std::string line;
  for (int count = 0; count < 200 && std::getline(stream, line); ++count) {
    if (line.size() > 4096) break;
    std::string key = line.substr(0, line.find_first_of("=:"));
    if (key.size() == line.size()) continue;
    key.erase(std::remove_if(key.begin(), key.end(), [](unsigned char c) { return std::isspace(c); }), key.end());
    std::transform(key.begin(), key.end(), key.begin(), [](unsigned char c) { return char(std::tolower(c)); });
    if (key != "elementdatafile" && key != "datafile") continue;
    std::string value = line.substr(line.find_first_of("=:") + 1);
    value.erase(0, value.find_first_not_of(" \t"));
    value.erase(value.find_last_not_of(" \t\r") + 1);
    return value == "LOCAL" || value == "Local" || value == "local" ? "" : value;
  }
  return "";
}

/// A path option counts by the content of what it names, so nothing outside that may be opened.
void check_detached(const fs::path& header, const fs::path& named) {
  const std::string data = detached_data(header);
  if (data.empty()) return;
  if (!fs::is_directory(named))
    throw Error(header.string() + ": keeps its samples in another file, '" + data +
                "'; name the folder that holds both, or convert to .mha or .nrrd");
  if (fs::path(data).filename() != data)
    throw Error(header.string() + ": names '" + data + "' for its samples; expected one file that lies beside it");
}

Samples read_single(const fs::path& path, const fs::path& named) {
  const std::string extension = lower_extension(path);
  if (extension == ".mha" || extension == ".mhd") {
    check_detached(path, named);
    return read_samples(path, Format::meta);
  }
  if (extension == ".nrrd" || extension == ".nhdr") {
    check_detached(path, named);
    return read_samples(path, Format::nrrd);
  }
  if (extension == ".nii" || (extension == ".gz" && lower_extension(path.stem()) == ".nii"))
    return read_samples(path, Format::nifti);
  if (extension == ".tif" || extension == ".tiff") return read_samples(path, Format::tiff);
  throw Error(path.string() +
              ": not a volume that can be read; known are .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .tif and a "
              "folder of DICOM slices (name the folder)");
}

fs::path detached_header_in(const fs::path& folder) {
  std::vector<fs::path> headers;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string extension = lower_extension(entry.path());
    if (extension == ".mhd" || extension == ".nhdr") headers.push_back(entry.path());
  }
  if (headers.size() > 1)
    throw Error(folder.string() + ": holds " + std::to_string(headers.size()) +
                " .mhd or .nhdr files; keep one per folder");
  return headers.empty() ? fs::path() : headers[0];
}

Grid grid_of(const Samples& samples) {
  Grid grid;
  grid.size = samples.size;
  grid.spacing_mm = Eigen::Map<const Eigen::Vector3d>(samples.spacing_mm.data());
  grid.origin_mm = Eigen::Map<const Eigen::Vector3d>(samples.origin_mm.data());
  grid.direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(samples.direction.data());
  return grid;
}

int axis_of(const std::string& name) {
  static const std::string kAxes = "xyz";
  if (name.size() != 1 || kAxes.find(name) == std::string::npos)
    throw Error("flip: expected axes x, y or z, got '" + name + "'");
  return int(kAxes.find(name));
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

void check_reading(const VolumeReading& reading) {
  if (!reading.voxel_size_mm.empty() && reading.voxel_size_mm.size() != 3)
    throw Error("voxel_size_mm: expected 3 lengths, got " + std::to_string(reading.voxel_size_mm.size()));
  for (double length : reading.voxel_size_mm)
    if (!(length > 0) || !std::isfinite(length))
      throw Error("voxel_size_mm: expected positive lengths, got " + std::to_string(length));
}

}  // namespace

Volume read_volume_file(const fs::path& path, const VolumeReading& reading) {
  check_reading(reading);
  std::error_code failure;
  if (!fs::exists(path, failure)) throw Error(path.string() + ": there is no such file or folder");
  const fs::path file = fs::is_directory(path) ? detached_header_in(path) : path;
  Volume volume;
  if (file.empty()) {
    DicomSeries series = read_dicom_series(path, reading.series_uid);
    volume = {grid_of(series.geometry), std::move(series.values)};
  } else {
    const Samples samples = read_single(file, path);
    const std::string extension = lower_extension(file);
    if (samples.components != 1)
      throw Error(file.string() + ": has " + std::to_string(samples.components) + " values per voxel; a CT has one");
    if (samples.dimensions < 3)
      throw Error(file.string() + ": is one image, not a volume; expected 3 dimensions, got " +
                  std::to_string(samples.dimensions));
    if ((extension == ".tif" || extension == ".tiff") && reading.voxel_size_mm.empty())
      throw Error(file.string() + ": a TIFF does not say how large its voxels are; give voxel_size_mm: [x, y, z]");
    volume = {grid_of(samples), to_float(samples)};
  }
  for (std::size_t k = 0; k < reading.voxel_size_mm.size(); ++k) volume.grid.spacing_mm[k] = reading.voxel_size_mm[k];
  for (const std::string& axis : reading.flip) flip(volume, axis_of(axis));
  if (reading.value_offset_hu != 0)
    for (float& value : volume.values) value = float(value + reading.value_offset_hu);
  check_volume(volume, path.string());
  return volume;
}

namespace {

/// One page or frame of samples as an image.
Image image_of(const Samples& samples, int frame, const fs::path& path) {
  const std::size_t pixels = std::size_t(samples.size[0]) * std::size_t(samples.size[1]);
  const std::size_t bytes_each = samples.bytes.size() / samples.count();
  const std::byte* first = samples.bytes.data() + std::size_t(frame - 1) * pixels * bytes_each;
  const int type = samples.type == Samples::Type::u8    ? CV_8U
                   : samples.type == Samples::Type::u16 ? CV_16U
                   : samples.type == Samples::Type::f32 ? CV_32F
                                                        : -1;
  if (type < 0) throw Error(path.string() + ": expected 8 or 16 bit grey levels without sign, or float");
  Image image{cv::Mat(samples.size[1], samples.size[0], type)};
  std::memcpy(image.pixels.data, first, pixels * bytes_each);
  if (type == CV_32F)
    for (const float value : cv::Mat_<float>(image.pixels))
      if (!std::isfinite(value)) throw Error(path.string() + ": has pixels that are not finite numbers");
  return image;
}

Samples read_dicom_image(const fs::path& path) {
  Samples samples = read_samples(path, Format::dicom);
  if (samples.components != 1 || samples.type == Samples::Type::u8 || samples.type == Samples::Type::u16) return samples;
  const std::vector<float> values = to_float(samples);  // signed, or scaled by its header
  samples.type = Samples::Type::f32;
  samples.bytes.resize(values.size() * sizeof(float));
  std::memcpy(samples.bytes.data(), values.data(), samples.bytes.size());
  return samples;
}

Image as_its_camera_sees(Image image, const fs::path& path) {
  const XrayPixels stored = read_xray_pixels(path);
  if (stored.mirrored) {
    cv::Mat mirrored;
    cv::flip(image.pixels, mirrored, 1);
    image.pixels = mirrored;
  }
  if (stored.inverted) {
    double largest = 0;
    cv::minMaxLoc(image.pixels, nullptr, &largest);
    image.pixels = cv::Mat(largest - image.pixels);
  }
  return image;
}

}  // namespace

Image read_image_file(const fs::path& path, int frame) {
  const std::string extension = lower_extension(path);
  const bool is_tiff = extension == ".tif" || extension == ".tiff", is_dicom = extension == ".dcm" || extension == ".dicom";
  if (!is_tiff && !is_dicom && extension != ".png")
    throw Error(path.string() + ": not an image that can be read; known are .png, .tif and .dcm");
  check_file(path);
  const Samples samples = is_dicom ? read_dicom_image(path) : is_tiff ? read_samples(path, Format::tiff) : read_png(path);
  if (samples.size[2] != 1 && frame == 0)
    throw Error(path.string() + ": has " + std::to_string(samples.size[2]) +
                (is_dicom ? " frames; name one with frame (from 1)"
                          : " pages; an image has one (read.volume reads stacks; frame, from 1, picks a page)"));
  if (frame > samples.size[2])
    throw Error(path.string() + ": has " + std::to_string(samples.size[2]) + " frames; there is no frame " + std::to_string(frame));
  if (samples.components != 1)
    throw Error(path.string() + ": has " + std::to_string(samples.components) +
                " channels; an X-ray image has one: save it as grey levels");
  const Image image = image_of(samples, std::max(1, frame), path);
  return is_dicom ? as_its_camera_sees(image, path) : image;
}

}  // namespace marrow::read
