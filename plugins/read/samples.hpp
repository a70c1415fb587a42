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

enum class Format { meta, nrrd, nifti, tiff, dicom };

/// Reads a whole file. Throws Error when it is damaged, is not of this format, or its header claims more samples than
/// the file can hold.
Samples read_samples(const std::filesystem::path& path, Format format);
Samples read_png(const std::filesystem::path& path);

/// Throws Error unless there is a regular file with something in it.
void check_file(const std::filesystem::path& path);
/// Throws Error where numbers of a MetaImage's header cannot be; MetaIO trusts them.
void check_meta_header(const std::filesystem::path& path);
/// Throws Error unless a MetaImage holds this many bytes of samples.
void check_meta_data(const std::filesystem::path& path, double sample_bytes);
/// Throws Error unless an NRRD file whose samples are not compressed holds this many bytes of them.
void check_nrrd_data(const std::filesystem::path& path, double sample_bytes, double samples);
/// Throws Error unless a NIfTI-1 file holds the samples that its header claims.
void check_nifti_data(const std::filesystem::path& path);
/// Throws Error when pages of a TIFF are missing at its end, differ in size, or claim more than the file holds.
void check_tiff_pages(const std::filesystem::path& path);
/// Throws Error when the file is not DICOM, or an element of it claims more than the file holds.
void check_dicom_file(const std::filesystem::path& path);
/// Throws Error when a file of `stored_bytes` cannot hold the `claimed_bytes` of samples that its header claims.
void check_claim(const std::string& what, const Samples& samples, double claimed_bytes, double stored_bytes);

/// The samples as float.
std::vector<float> to_float(const Samples& samples);

/// A CT series: all slices of one series in a folder, sorted by position and checked for gaps, as HU. `series_uid`
/// picks one where the folder holds several; empty = there must be just one. Throws Error.
struct DicomSeries {
  Samples geometry;  ///< without bytes
  std::vector<float> values;
};
DicomSeries read_dicom_series(const std::filesystem::path& folder, const std::string& series_uid);

}  // namespace marrow::read
