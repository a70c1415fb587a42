// SPDX-License-Identifier: Apache-2.0
#pragma once
// The narrow door to ITK: its headers bring an Eigen of their own, so they stay in the .cpp files behind this one.
#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace marrow::read {

/// What a file of samples holds, as it is stored: one to three dimensions, missing ones having size 1.
struct Samples {
  std::array<int, 3> size{1, 1, 1};
  std::array<double, 3> spacing_mm{1, 1, 1};
  std::array<double, 3> origin_mm{0, 0, 0};
  std::array<double, 9> direction{1, 0, 0, 0, 1, 0, 0, 0, 1};  ///< row by row; columns are the grid's axes
  int dimensions = 0;
  int components = 1;
  enum class Type { u8, i8, u16, i16, u32, i32, u64, i64, f32, f64 } type = Type::u8;
  std::vector<std::byte> bytes;  ///< x runs fastest, then y, then z

  std::size_t count() const { return std::size_t(size[0]) * std::size_t(size[1]) * std::size_t(size[2]); }
};

enum class Format { meta, nrrd, nifti, tiff, png };

/// Reads a whole file. Throws Error when it is damaged, is not of this format, or its header claims more samples than the
/// file can hold.
Samples read_samples(const std::filesystem::path& path, Format format);

/// The samples as float.
std::vector<float> to_float(const Samples& samples);

/// A CT series: all slices of one series in a folder, sorted by position and checked for gaps, as HU. `series_uid` picks one
/// where the folder holds several; empty = there must be just one. Throws Error.
struct DicomSeries {
  Samples geometry;  ///< without bytes
  std::vector<float> values;
};
DicomSeries read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid);

}  // namespace marrow::read
