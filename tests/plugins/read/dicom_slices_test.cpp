// SPDX-License-Identifier: Apache-2.0
// The slices of a series lie within 0.1 mm of an even, straight grid, and none is missing.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/dicom_text.hpp"
#include "tests/plugins/read/files.hpp"

namespace dicom_slices_test {

using namespace marrow::test;

std::string rounded(double value, int decimals) {
  char text[32];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

class DicomSlices : public testing::Test {
 protected:
  /// Slices at these z, which are written as given. All values of a slice are its number.
  marrow::Volume series(const std::vector<std::string>& z_mm) {
    std::filesystem::remove_all(folder / "ct");
    for (std::size_t i = 0; i < z_mm.size(); ++i) {
      Elements slice = ct_slice(0);
      slice[0x00200032] = "DS:-115.5\\-1.85\\" + z_mm[i];
      slice[0x7FE00010] = "OW:";
      for (int k = 0; k < 12; ++k) slice[0x7FE00010] += little(std::uint32_t(i), 2);
      put(folder / ("ct/s" + std::to_string(100 + i)), dicom_file(slice));
    }
    return marrow::files::read_volume_file(folder / "ct", {});
  }
  TemporaryFolder folder;
};

// The spacing follows from the first and the last position as written: for 0.625 mm with two decimals 11.88 mm / 19.
TEST_F(DicomSlices, WithRoundedPositionsAreRead) {
  for (const double gap_mm : {0.3, 0.4, 0.625, 0.75, 0.8, 1.25, 2.5})
    for (const int decimals : {1, 2, 3}) {
      std::vector<std::string> z_mm;
      for (int i = 0; i < 20; ++i) z_mm.push_back(rounded(736.17 + gap_mm * i, decimals));
      const marrow::Volume volume = series(z_mm);
      SCOPED_TRACE(std::to_string(gap_mm) + " mm, " + std::to_string(decimals) + " decimals");
      ASSERT_EQ(volume.grid.size[2], 20);
      EXPECT_NEAR(volume.grid.origin_mm[2], std::stod(z_mm.front()), 1e-9);
      EXPECT_NEAR(volume.grid.spacing_mm[2], (std::stod(z_mm.back()) - std::stod(z_mm.front())) / 19, 1e-9);
      EXPECT_EQ(volume.at(0, 0, 7), 7 - 1024);
    }
}

TEST_F(DicomSlices, ThatAreMissingAreNoticedAtAnyDistanceAndRounding) {
  for (const double gap_mm : {0.05, 0.1, 0.3, 0.625, 1.0, 5.0})
    for (const int decimals : {1, 2, 3})
      for (const int count : {4, 20})
        for (const int missing : {1, count / 2, count - 2}) {
          if (gap_mm < 2 * std::pow(10, -decimals)) continue;  // the rounded positions say nothing then
          std::vector<std::string> z_mm;
          for (int i = 0; i < count; ++i)
            if (i != missing) z_mm.push_back(rounded(gap_mm * i, decimals));
          SCOPED_TRACE(std::to_string(gap_mm) + " mm, slice " + std::to_string(missing) + " of " +
                       std::to_string(count));
          EXPECT_SAYS(series(z_mm), "a slice is missing or the series is unevenly spaced");
        }
}

// In an oblique series the first slice's own rounding may be as large as that of any other: by numpy, slices lie up to
// 0.127 mm sideways of the first one here, and up to 0.064 mm of the straight line through all.
TEST_F(DicomSlices, OfAnObliqueSeriesWithOneDecimalAreRead) {
  for (int i = 0; i < 30; ++i) {
    Elements slice = ct_slice(0);
    slice[0x00200037] = "DS:0.8\\0.6\\0\\-0.36\\0.48\\0.8";
    slice[0x00200032] = "DS:" + rounded(-115.448 + 0.8 * 0.48 * i, 1) + "\\" + rounded(-1.782 - 0.8 * 0.64 * i, 1) +
                        "\\" + rounded(3.04 + 0.8 * 0.6 * i, 1);
    put(folder / ("ct/s" + std::to_string(100 + i)), dicom_file(slice));
  }
  EXPECT_EQ(marrow::files::read_volume_file(folder / "ct", {}).grid.size[2], 30);
}

TEST_F(DicomSlices, FartherThanATenthOfAMillimetreFromTheGridAreRefused) {
  EXPECT_EQ(series({"0", "1.09", "2", "3"}).grid.size[2], 4);
  EXPECT_SAYS(series({"0", "1.11", "2", "3"}),
              "the slices are unevenly spaced; some lie up to 0.11 mm from where even ones of 1 mm would");
}

// The positions by pydicom: 20 of 0 to 11.88 mm, at most 0.0095 mm from the grid, and 6 of 736.17 to 761.25 mm.
TEST_F(DicomSlices, OfRealSeriesWithRoundedPositionsAreRead) {
  MARROW_NEED_DATA(folder, "strangers/slices");
  const marrow::Volume rounded = marrow::files::read_volume_file(folder / "dz0.625_dec2", {});
  EXPECT_EQ(rounded.grid.size[2], 20);
  EXPECT_NEAR(rounded.grid.spacing_mm[2], 11.88 / 19, 1e-9);
  EXPECT_NEAR(rounded.grid.origin_mm[2], 0, 1e-9);
  const marrow::Volume jitter = marrow::files::read_volume_file(folder / "jitter_0.04mm", {});
  EXPECT_EQ(jitter.grid.size[2], 6);
  EXPECT_NEAR(jitter.grid.spacing_mm[2], (761.25 - 736.17) / 5, 1e-9);
  EXPECT_NEAR(jitter.grid.origin_mm[2], 736.17, 1e-9);
}

}  // namespace dicom_slices_test
