// SPDX-License-Identifier: Apache-2.0
#pragma once
// Files written by ITK itself, so that the readers are tested on what another program made.
#include <array>
#include <cstdint>
#include <vector>

#include "tests/plugins/read/files.hpp"

namespace marrow::test {

/// A grid of samples for write_itk(). axes[k]: direction of grid axis k.
template <class T>
struct ItkGrid {
  std::vector<unsigned> size{};
  std::vector<T> samples{};
  unsigned components = 1;
  std::vector<double> spacing{1, 1, 1}, origin{0, 0, 0};
  std::vector<std::vector<double>> axes{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
};

/// Samples 0, step, 2 step, ...; with step 0 all are `first`.
template <class T>
ItkGrid<T> ramp(const std::vector<unsigned>& size, double step, double first = 0) {
  ItkGrid<T> grid{.size = size};
  std::size_t count = 1;
  for (const unsigned length : size) count *= length;
  for (std::size_t i = 0; i < count; ++i) grid.samples.push_back(T(first + double(i) * step));
  return grid;
}
template <class T>
ItkGrid<T> filled(const std::vector<unsigned>& size, double value) {
  return ramp<T>(size, 0, value);
}

/// Writes by the extension: .mha, .mhd, .nrrd, .nhdr, .nii, .nii.gz, .tif, .png.
template <class T>
void write_itk(const std::filesystem::path& path, const ItkGrid<T>& grid, bool compressed = false);

/// The bytes of such a file.
template <class T>
std::string itk_bytes(const std::string& extension, const ItkGrid<T>& grid, bool compressed = false) {
  const TemporaryFolder folder;
  write_itk(folder / ("a" + extension), grid, compressed);
  return bytes_of(folder / ("a" + extension));
}

/// The distance of samples as ITK reads it from a MetaImage's header.
std::vector<double> itk_meta_spacing(const std::filesystem::path& path);

struct DicomSlice {
  std::string series = "1.2.3.4", modality = "CT";
  std::array<double, 3> position{0, 0, 0};
  std::string orientation = "1\\0\\0\\0\\1\\0";
  int width = 4, height = 3;
  std::vector<std::int16_t> values;  ///< HU
};
void write_dicom(const std::filesystem::path& path, const DicomSlice& slice);

/// Writes the image of a DICOM file again in another transfer syntax.
void compress_dicom(const std::filesystem::path& from, const std::filesystem::path& to,
                    const std::string& transfer_syntax);

}  // namespace marrow::test
