// SPDX-License-Identifier: Apache-2.0
#pragma once
// Grids of samples as files hold them: what the readers of the formats have in common.
#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/toolbox/files/input_file.hpp"

namespace marrow::files {

/// What a file of samples holds, as it is stored: one to three dimensions, missing ones having size 1.
struct Samples {
  std::array<int, 3> size{1, 1, 1};
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row; columns are the grid's axes
  int dimensions = 0;
  int components = 1;
  std::string spacing_field;  ///< where the file does not say how large voxels are: what its header would have to say
  std::string other_pages;    ///< of a TIFF whose pages are not the slices of one volume: what they are
  enum class Type { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 } type = Type::u8;
  double slope = 1, intercept = 0;  ///< value = slope * sample + intercept
  std::vector<std::byte> bytes;     ///< x runs fastest, then y, then z

  std::size_t count() const { return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]); }
};

/// Headers give directions with as few as four digits: the product of two axes may be so far from 0, and is made 0. At
/// the ends of 400 mm this is 0.1 mm.
constexpr double kRoundedDirection = 5e-4;

std::size_t bytes_each(Samples::Type type);

/// A volume: its grid, and its samples as float.
struct VolumeSamples {
  Samples geometry;  ///< without bytes
  std::vector<float> values;
};

VolumeSamples read_meta_image(const std::filesystem::path& path, bool folder_is_named);
VolumeSamples read_nrrd(const std::filesystem::path& path, bool folder_is_named);
VolumeSamples read_nifti(const std::filesystem::path& path);
/// A CT series: all slices of one series in a folder, sorted by position and checked for gaps, as HU. `series_uid`
/// picks one where the folder holds several; empty = there must be just one. Throws Error.
VolumeSamples read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid);
/// Whether a file begins as those of DICOM do.
bool looks_like_dicom(const std::filesystem::path& path);

/// All pages of a TIFF. Where it has colours, `components` says so and there are no bytes.
Samples read_tiff(const std::filesystem::path& path);
Samples read_png(const std::filesystem::path& path);

/// Throws Error where a size of the header is none of a volume or image, or where a file of `stored_bytes` cannot hold
/// so many samples: this comes before any memory is taken for them. No CT or image is packed more tightly than 500
/// samples a byte; zlib ends at 1032.
void check_size(const std::string& what, const std::array<long long, 3>& size, std::uint64_t stored_bytes,
                double most_samples_per_byte = 500);

/// Where a file holds the samples of a volume, and how.
struct StoredSamples {
  std::uint64_t begin = 0;
  bool is_packed = false;  ///< a zlib or gzip stream begins there
  std::uint64_t skip = 0;  ///< bytes of what it unpacks to that are none
  Samples::Type type = Samples::Type::u8;
  bool big_endian = false;
  std::size_t count = 0;
  double slope = 1, intercept = 0;
};
/// Throws Error unless all of them are there, and nothing behind them.
std::vector<float> read_floats(const InputFile& file, const StoredSamples& stored);

/// The values of the samples as float.
std::vector<float> to_float(const Samples& samples);

}  // namespace marrow::files
