// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/volume_out.hpp"

#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cstring>
#include <string_view>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"

namespace marrow::run {
namespace {

namespace fs = std::filesystem;

static_assert(std::endian::native == std::endian::little, "all of these files say that their numbers are so");

struct Samples {
  std::string_view bytes;
  bool are_floats = true;
};

std::string listed(const auto& values) {
  std::string text;
  for (const auto value : values) text += " " + exact_number(double(value));
  return text;
}

std::string mha_header(const Grid& grid, bool are_floats) {
  std::string matrix;
  for (int k = 0; k < 3; ++k) matrix += listed(Eigen::Vector3d(grid.direction.col(k)));
  return formatted(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = "
      "False\nTransformMatrix ={}\nOffset ={}\nCenterOfRotation = 0 0 0\nElementSpacing ={}\nDimSize ={}\nElementType "
      "= {}\nElementDataFile = LOCAL\n",
      matrix, listed(grid.origin_mm), listed(grid.spacing_mm), listed(grid.size),
      are_floats ? "MET_FLOAT" : "MET_UCHAR");
}

std::string vector_text(const Eigen::Vector3d& vector) {
  return "(" + exact_number(vector[0]) + "," + exact_number(vector[1]) + "," + exact_number(vector[2]) + ")";
}

std::string nrrd_header(const Grid& grid, bool are_floats) {
  std::string directions;
  for (int k = 0; k < 3; ++k)
    directions += " " + vector_text(Eigen::Vector3d(grid.direction.col(k)) * grid.spacing_mm[k]);
  return formatted(
      "NRRD0004\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes:{}\nspace directions:{}\nkinds: domain "
      "domain domain\nendian: little\nencoding: raw\nspace origin: {}\n\n",
      are_floats ? "float" : "uchar", listed(grid.size), directions, vector_text(grid.origin_mm));
}

/// The header of NIfTI-1 (nifti1.h of the NIfTI data format working group) with its four bytes of extension.
std::string nifti_header(const Grid& grid, bool are_floats) {
  std::string header(352, '\0');
  const auto put = [&](std::size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
  const Eigen::Vector3d ras_from_lps(-1, -1, 1);
  const Eigen::Matrix3d rotation = ras_from_lps.asDiagonal() * grid.direction;
  const Eigen::Vector3d origin = ras_from_lps.cwiseProduct(grid.origin_mm);
  Eigen::Quaterniond turn(rotation);
  if (turn.w() < 0) turn.coeffs() *= -1;  // the file holds b, c and d, and a >= 0 is made from them
  put(0, std::int32_t(348));
  put(40, std::int16_t(3));
  for (std::size_t k = 0; k < 7; ++k) put(42 + 2 * k, std::int16_t(k < 3 ? grid.size[k] : 1));
  put(70, std::int16_t(are_floats ? 16 : 2));
  put(72, std::int16_t(are_floats ? 32 : 8));
  put(76, 1.f);  // the grid is right-handed
  for (int k = 0; k < 7; ++k) put(80 + 4 * std::size_t(k), k < 3 ? float(grid.spacing_mm[k]) : 1.f);
  put(108, 352.f);
  put(112, 1.f);
  put(123, std::int8_t(2));   // mm
  put(252, std::int16_t(1));  // both transforms lead to the scanner's axes
  put(254, std::int16_t(1));
  put(256, float(turn.x()));
  put(260, float(turn.y()));
  put(264, float(turn.z()));
  for (int row = 0; row < 3; ++row) {
    put(268 + 4 * std::size_t(row), float(origin[row]));
    for (int k = 0; k < 3; ++k)
      put(280 + 16 * std::size_t(row) + 4 * std::size_t(k), float(rotation(row, k) * grid.spacing_mm[k]));
    put(292 + 16 * std::size_t(row), float(origin[row]));
  }
  std::memcpy(header.data() + 344, "n+1", 4);
  return header;
}

void write_gzip(const fs::path& file, std::initializer_list<std::string_view> parts) {
  const gzFile stream = gzopen(file.c_str(), "wb1");
  bool is_good = stream != nullptr;
  for (const std::string_view part : parts)
    for (std::size_t at = 0; is_good && at < part.size();) {
      const unsigned count = unsigned(std::min<std::size_t>(part.size() - at, std::size_t(1) << 30));
      is_good = gzwrite(stream, part.data() + at, count) == int(count);
      at += count;
    }
  if (stream) is_good = gzclose(stream) == Z_OK && is_good;
  if (!is_good) throw Error("cannot write " + file.string() + "; is the disk full?");
}

void check(const Grid& grid, std::size_t samples) {
  const bool is_large = std::any_of(grid.size.begin(), grid.size.end(), [](int size) { return size > 32767; });
  if (grid.count() == 0 || grid.count() != samples || is_large)
    throw Error(formatted("a volume of {} x {} x {} voxels with {} values cannot be written", grid.size[0],
                          grid.size[1], grid.size[2], samples));
}

void write(const fs::path& file, const std::string& format, const Grid& grid, const Samples& samples) {
  if (format == "mha") return files::write_plainly(file, {mha_header(grid, samples.are_floats), samples.bytes});
  if (format == "nrrd") return files::write_plainly(file, {nrrd_header(grid, samples.are_floats), samples.bytes});
  const std::string header = nifti_header(grid, samples.are_floats);
  format == "nii" ? files::write_plainly(file, {header, samples.bytes}) : write_gzip(file, {header, samples.bytes});
}

}  // namespace

std::vector<std::string> formats_of_volumes() { return {"mha", "nrrd", "nii", "nii.gz"}; }

void write_volume(const fs::path& file, const std::string& format, const Grid& grid,
                  const std::vector<float>& samples) {
  check(grid, samples.size());
  write(file, format, grid, {{reinterpret_cast<const char*>(samples.data()), samples.size() * sizeof(float)}, true});
}

void write_volume(const fs::path& file, const std::string& format, const Grid& grid,
                  const std::vector<std::uint8_t>& samples) {
  check(grid, samples.size());
  write(file, format, grid, {{reinterpret_cast<const char*>(samples.data()), samples.size()}, false});
}

}  // namespace marrow::run
