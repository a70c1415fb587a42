// SPDX-License-Identifier: Apache-2.0
// NIfTI files that say twice where they lie: by an sform and by a qform; and NIfTI-2.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/files.hpp"
#include "tests/plugins/read/hostile.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace nifti_test {

using namespace marrow::test;

class TwoPlaces : public testing::Test {
 protected:
  TwoPlaces() {
    write_itk(folder / "a.nii", ItkGrid<std::int16_t>{.size = {4, 5, 30}, .samples = std::vector<std::int16_t>(600)});
  }
  std::string with_codes(int sform, int qform) const {
    return replaced(replaced(bytes_of(folder / "a.nii"), 254, number(std::int16_t(sform))), 252,
                    number(std::int16_t(qform)));
  }
  marrow::Grid grid_of(const std::string& bytes) {
    put(folder / "b.nii", bytes);
    return marrow::files::read_volume_file(folder / "b.nii", {}).grid;
  }
  void expect_refused(const std::string& bytes, const std::string& text) {
    put(folder / "b.nii", bytes);
    EXPECT_REFUSED(marrow::files::read_volume_file(folder / "b.nii", {}), "b.nii", text);
  }
  TemporaryFolder folder;
};

/// Where an element of the sform lies in the header.
std::size_t place(std::size_t row, std::size_t column) { return 280 + 16 * row + 4 * column; }

// A CT of a tilted gantry: the qform cannot say it, and the last slice would lie tens of millimetres off.
TEST_F(TwoPlaces, ShearedSformIsNotThrownAway) {
  const float z = std::sqrt(1 - 0.26f * 0.26f);  // the third column stays 1 mm long
  for (const auto& [sform, qform] : {std::pair{1, 1}, {1, 2}, {2, 2}, {3, 1}})
    expect_refused(replaced(replaced(with_codes(sform, qform), place(1, 2), number(0.26f)), place(2, 2), number(z)),
                   "do not agree: the sform is a matrix that is sheared");
  const std::string rounded = replaced(with_codes(1, 1), place(0, 2), number(0.0006f));  // 0.017 mm at the last slice
  EXPECT_TRUE(grid_of(rounded).direction.isIdentity(1e-6));
  const std::string other_scan = replaced(with_codes(2, 1), place(1, 2), number(0.26f));
  EXPECT_TRUE(grid_of(other_scan).direction.isIdentity(1e-6));  // decided: then the qform is this scan's
}

TEST_F(TwoPlaces, DamagedSformIsNotThrownAway) {
  for (const int sform : {1, 2}) {
    const std::string bytes = with_codes(sform, 1);
    expect_refused(replaced(bytes, place(0, 1), number(std::nanf(""))),
                   "sheared (as of a CT with a tilted gantry) or damaged");
    expect_refused(replaced(bytes, place(0, 3), number(HUGE_VALF)), "or damaged");
    expect_refused(replaced(bytes, place(2, 2), number(0.f)), "or damaged");
  }
}

TEST_F(TwoPlaces, SformBesideTheQform) {
  const std::string moved = number(25.f);
  EXPECT_EQ(grid_of(replaced(with_codes(1, 1), place(2, 3), moved)).origin_mm[2], 25);  // the scanner's own
  EXPECT_EQ(grid_of(replaced(with_codes(2, 1), place(2, 3), moved)).origin_mm[2], 0);
  for (const auto& [sform, qform] : {std::pair{2, 2}, {3, 1}, {4, 1}, {4, 4}})
    expect_refused(replaced(with_codes(sform, qform), place(2, 3), moved),
                   "its sform (code " + std::to_string(sform) + ") and its qform (code " + std::to_string(qform) +
                       ") put the same voxels to different places");
  EXPECT_FLOAT_EQ(float(grid_of(replaced(with_codes(3, 1), place(2, 3), number(0.001f))).origin_mm[2]), 0.001f);
}

// nibabel refuses such a quaternion, too, if its squared length is 1 + 3.6e-7 or more. Scaled to 1 it would be another
// turn.
TEST_F(TwoPlaces, QuaternionLongerThanARotationHas) {
  const auto turned = [&](float b, float c, float d) {
    return replaced(with_codes(0, 1), 256, number(b) + number(c) + number(d));
  };
  expect_refused(turned(1.32f, 0, 0),
                 "the quaternion (b, c, d) of its qform has the length 1.32, but that of a rotation is at most 1; it "
                 "is damaged, or was written wrongly: export it again, or set qform_code to 0 if its sform is right");
  expect_refused(turned(0.6f, 0.6f, 0.6f), "has the length 1.03923");
  expect_refused(turned(0.71f, 0.71f, 0), "has the length 1.00409");
  // A half turn about x, with float's rounding: RAS (x, -y, -z), so LPS has the other signs of x and y.
  const Eigen::Matrix3d half = Eigen::Vector3d(-1, 1, -1).asDiagonal();
  for (const float b : {1.f, 1.000001f}) EXPECT_TRUE(grid_of(turned(b, 0, 0)).direction.isApprox(half, 1e-6)) << b;
  const std::string by_sform = replaced(with_codes(1, 1), 256, number(1.32f));
  EXPECT_TRUE(grid_of(by_sform).direction.isIdentity(1e-6))
      << "the sform of the scanner is used, so it does not matter";
  expect_refused(replaced(with_codes(2, 1), 256, number(1.32f) + number(0.f) + number(0.f)), "has the length 1.32");
}

/// A header of NIfTI-2 by https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h, whose numbers are wider: 540 bytes, then
/// four that name no extensions.
std::string nifti2(bool big_endian, int sform, int qform) {
  std::string header(544, '\0');
  const auto set = [&](std::size_t at, auto value) {
    std::string bytes = number(value);
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    header.replace(at, bytes.size(), bytes);
  };
  set(0, std::int32_t(540));
  header.replace(4, 8, std::string("n+2\0\r\n\x1A\n", 8));
  set(12, std::int16_t(4)), set(14, std::int16_t(16));
  for (const auto& [k, size] : {std::pair{0, 3}, {1, 4}, {2, 3}, {3, 2}})
    set(16 + 8 * std::size_t(k), std::int64_t(size));
  for (const auto& [k, length] : {std::pair{0, 1.0}, {1, 0.5}, {2, 0.75}, {3, 1.25}})
    set(104 + 8 * std::size_t(k), length);
  set(168, std::int64_t(544));
  set(176, 2.0), set(184, -1024.0);
  set(344, std::int32_t(qform)), set(348, std::int32_t(sform));
  set(376, 10.0), set(384, 20.0), set(392, 30.0);
  const double rows[3][4] = {{0.5, 0, 0, 10}, {0, 0.75, 0, 20}, {0, 0, 1.25, 30}};
  for (std::size_t i = 0; i < 12; ++i) set(400 + 8 * i, rows[i / 4][i % 4]);
  set(500, std::int32_t(2));
  std::string samples;
  for (int i = 0; i < 24; ++i) {
    std::string bytes = number(std::int16_t(i * 13));
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    samples += bytes;
  }
  return header + samples;
}

class SecondVersion : public TwoPlaces {};

TEST_F(SecondVersion, IsReadAsTheFirst) {
  for (const bool big_endian : {false, true})
    for (const auto& [sform, qform] : {std::pair{1, 0}, {0, 1}, {1, 1}}) {
      put(folder / "c.nii", nifti2(big_endian, sform, qform));
      const marrow::Volume volume = marrow::files::read_volume_file(folder / "c.nii", {});
      EXPECT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 2}));
      EXPECT_EQ(volume.grid.spacing_mm, Eigen::Vector3d(0.5, 0.75, 1.25));
      // RAS becomes LPS; the axes are then left-handed only if an odd number of them turns, and two do.
      EXPECT_EQ(volume.grid.origin_mm, Eigen::Vector3d(-10, -20, 30));
      const Eigen::Matrix3d turned = Eigen::Vector3d(-1, -1, 1).asDiagonal();
      EXPECT_EQ(volume.grid.direction, turned);
      EXPECT_EQ(volume.at(3, 2, 1), 2 * 23 * 13 - 1024);
    }
  const gzFile packed = gzopen((folder / "c.nii.gz").c_str(), "wb");
  const std::string bytes = nifti2(false, 1, 0);
  gzwrite(packed, bytes.data(), unsigned(bytes.size()));
  gzclose(packed);
  EXPECT_EQ(marrow::files::read_volume_file(folder / "c.nii.gz", {}).at(3, 2, 1), 2 * 23 * 13 - 1024);
}

TEST_F(SecondVersion, FaultsAreThoseOfTheFirst) {
  const std::string bytes = nifti2(false, 1, 0);
  expect_refused(replaced(bytes, 4, "ni2"), "is not a NIfTI file with its samples in it");
  expect_refused(replaced(bytes, 8, "\n\n"), "is not a NIfTI file with its samples in it, or is damaged at its start");
  expect_refused(replaced(bytes, 168, number(std::int64_t(352))), "samples begin at byte 352.000000");
  expect_refused(replaced(bytes, 16, number(std::int64_t(9))), "tells of 9 dimensions");
  expect_refused(replaced(bytes, 24, number(std::int64_t(1) << 40)), "gives a size of 1099511627776");
  expect_refused(replaced(nifti2(false, 0, 1), 352, number(1.32)), "has the length 1.32");
  expect_refused(bytes.substr(0, 500), "is not a NIfTI file");
}

}  // namespace nifti_test
