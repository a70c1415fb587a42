// SPDX-License-Identifier: Apache-2.0
// NIfTI files: headers that lie, or say twice where the volume lies (by an sform and by a qform); and NIfTI-2.
#include <zlib.h>

#include "marrow/toolbox/files/volume_file.hpp"
#include "tests/plugins/read/damage.hpp"
#include "tests/plugins/read/itk_files.hpp"

namespace nifti_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector3d, Eigen::Matrix3d;

class Nifti : public InAFolder {
 protected:
  Volume of(const std::string& bytes) {
    put(folder / "b.nii", bytes);
    return files::read_volume_file(folder / "b.nii", {});
  }
  Grid grid_of(const std::string& bytes) { return of(bytes).grid; }
  void expect_refused(const std::string& bytes, const std::string& text) { EXPECT_REFUSED(of(bytes), "b.nii", text); }
};

std::string good() { return itk_bytes(".nii", ramp<std::int16_t>({8, 6, 5}, 13, -1000)); }
std::string short_at(std::string bytes, std::size_t at, int value) {
  return replaced(std::move(bytes), at, number(std::int16_t(value)));
}
std::string float_at(std::string bytes, std::size_t at, float value) {
  return replaced(std::move(bytes), at, number(value));
}

TEST_F(Nifti, FieldsThatLie) {
  const std::string bytes = good();
  expect_refused(short_at(bytes, 70, 16),
                 "says that samples are of type 16, which have 32 bits, and that they have 16 bits");
  expect_refused(short_at(bytes, 72, 8), "type 4, which have 16 bits, and that they have 8 bits");
  expect_refused(short_at(bytes, 70, 1536), "of type 1536, which is not read");
  expect_refused(short_at(bytes, 70, 32), "of type 32, which is not read");
  for (const float place : {std::nanf(""), HUGE_VALF, -1.f, 0.f, 352.5f, 1e30f})
    expect_refused(float_at(bytes, 108, place), "samples begin at byte");
  expect_refused(float_at(bytes, 80, std::nanf("")), "is not a positive length");
  expect_refused(float_at(bytes, 80, -1), "is not a positive length");
  expect_refused(float_at(bytes, 112, HUGE_VALF), "scales samples by a number that is not finite");
  expect_refused(short_at(bytes, 42, -8), "gives a size of -8");
  expect_refused(short_at(bytes, 40, 9), "tells of 9 dimensions");
  expect_refused(short_at(bytes, 46, 6), "is cut off or damaged: 576 bytes of samples expected, got 480");
  expect_refused(replaced(bytes, 344, "ni1"), "is not a NIfTI file with its samples in it");
}

TEST_F(Nifti, SaysWhereItLies) {
  const std::string no_sform = short_at(good(), 254, 0), no_qform = short_at(good(), 252, 0);
  EXPECT_LT((grid_of(no_sform).direction - Matrix3d::Identity()).norm(), 1e-6) << "by its quaternion";
  expect_refused(float_at(no_qform, 284, 0.5f), "by a matrix that is sheared or damaged");
  expect_refused(short_at(no_qform, 254, 0),
                 "does not say which axis is left or right, front or back, up or down (qform_code and sform_code are "
                 "0)");
  expect_refused(float_at(no_qform, 88, 1.5f),
                 "says twice how large a voxel is along axis 3: 1.000000 mm by its sform, 1.500000 mm by its pixdim");
  EXPECT_EQ(grid_of(float_at(no_qform, 88, 1.0005f)).spacing_mm[2], 1);
}

TEST_F(Nifti, ABombIsRefusedBeforeItIsUnpacked) {
  std::string header = short_at(short_at(good().substr(0, 352), 70, 2), 72, 8);
  for (const std::size_t at : {42, 44, 46}) header = short_at(header, at, 400);
  const gzFile file = gzopen((folder / "bomb.nii.gz").c_str(), "wb9");
  gzwrite(file, header.data(), unsigned(header.size()));
  const std::vector<char> zeros(1 << 20);
  for (int i = 0; i < 62; ++i) gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  ASSERT_LT(std::filesystem::file_size(folder / "bomb.nii.gz"), 70000u);
  EXPECT_REFUSED(files::read_volume_file(folder / "bomb.nii.gz", {}), "bomb.nii.gz",
                 "its header claims 400 x 400 x 400 samples, but the file has only");
}

TEST_F(Nifti, InOtherUnitsLiesWhereItSays) {
  ItkGrid<std::int16_t> grid = ramp<std::int16_t>({8, 6, 5}, 13, -1000);
  for (const auto& [unit, scale] : {std::pair{1, 1e3}, std::pair{3, 1e-3}}) {
    grid.spacing = {0.5 / scale, 0.75 / scale, 1.25 / scale};
    grid.origin = {10 / scale, 20 / scale, 30 / scale};
    const std::string bytes = replaced(itk_bytes(".nii", grid), 123, std::string(1, char(unit)));
    for (const std::size_t missing : {252, 254}) {
      const Grid read = grid_of(short_at(bytes, missing, 0));
      EXPECT_LT((read.spacing_mm - Vector3d(0.5, 0.75, 1.25)).norm(), 1e-6) << unit;
      EXPECT_LT((read.origin_mm - Vector3d(10, 20, 30)).norm(), 1e-5) << unit;
    }
  }
}

class TwoPlaces : public Nifti {
 protected:
  std::string with_codes(int sform, int qform) const {
    static const std::string plain = itk_bytes(".nii", filled<std::int16_t>({4, 5, 30}, 0));
    return short_at(short_at(plain, 254, sform), 252, qform);
  }
};

/// Where an element of the sform lies in the header.
std::size_t place(std::size_t row, std::size_t column) { return 280 + 16 * row + 4 * column; }

// A CT of a tilted gantry: the qform cannot say it, and the last slice would lie tens of millimetres off.
TEST_F(TwoPlaces, ShearedSformIsNotThrownAway) {
  const float z = std::sqrt(1 - 0.26f * 0.26f);  // the third column stays 1 mm long
  for (const auto& [sform, qform] : {std::pair{1, 1}, {1, 2}, {2, 2}, {3, 1}})
    expect_refused(float_at(float_at(with_codes(sform, qform), place(1, 2), 0.26f), place(2, 2), z),
                   "do not agree: the sform is a matrix that is sheared");
  const std::string rounded = float_at(with_codes(1, 1), place(0, 2), 0.0006f);  // 0.017 mm at the last slice
  EXPECT_TRUE(grid_of(rounded).direction.isIdentity(1e-6));
  const std::string other_scan = float_at(with_codes(2, 1), place(1, 2), 0.26f);
  EXPECT_TRUE(grid_of(other_scan).direction.isIdentity(1e-6));  // decided: then the qform is this scan's
}

TEST_F(TwoPlaces, DamagedSformIsNotThrownAway) {
  for (const int sform : {1, 2}) {
    const std::string bytes = with_codes(sform, 1);
    expect_refused(float_at(bytes, place(0, 1), std::nanf("")), "sheared (as of a CT with a tilted gantry) or damaged");
    expect_refused(float_at(bytes, place(0, 3), HUGE_VALF), "or damaged");
    expect_refused(float_at(bytes, place(2, 2), 0), "or damaged");
  }
}

TEST_F(TwoPlaces, SformBesideTheQform) {
  const auto moved = [&](int sform, int qform) { return float_at(with_codes(sform, qform), place(2, 3), 25); };
  EXPECT_EQ(grid_of(moved(1, 1)).origin_mm[2], 25);  // the scanner's own
  EXPECT_EQ(grid_of(moved(2, 1)).origin_mm[2], 0);
  for (const auto& [sform, qform] : {std::pair{2, 2}, {3, 1}, {4, 1}, {4, 4}})
    expect_refused(moved(sform, qform), "its sform (code " + std::to_string(sform) + ") and its qform (code " +
                                            std::to_string(qform) + ") put the same voxels to different places");
  EXPECT_FLOAT_EQ(float(grid_of(float_at(with_codes(3, 1), place(2, 3), 0.001f)).origin_mm[2]), 0.001f);
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
  const Matrix3d half = Vector3d(-1, 1, -1).asDiagonal();
  for (const float b : {1.f, 1.000001f}) EXPECT_TRUE(grid_of(turned(b, 0, 0)).direction.isApprox(half, 1e-6)) << b;
  EXPECT_TRUE(grid_of(float_at(with_codes(1, 1), 256, 1.32f)).direction.isIdentity(1e-6))
      << "the sform of the scanner is used, so it does not matter";
  expect_refused(replaced(with_codes(2, 1), 256, number(1.32f) + number(0.f) + number(0.f)), "has the length 1.32");
}

/// A header of NIfTI-2 by https://nifti.nimh.nih.gov/pub/dist/doc/nifti2.h, whose numbers are wider: 540 bytes, then
/// four that name no extensions.
std::string nifti2(bool big_endian, int sform, int qform) {
  std::string file(544, '\0');
  const auto set = [&](std::size_t at, auto value) {
    std::string bytes = number(value);
    if (big_endian) std::reverse(bytes.begin(), bytes.end());
    file.replace(at, bytes.size(), bytes);
  };
  set(0, std::int32_t(540));
  file.replace(4, 8, std::string("n+2\0\r\n\x1A\n", 8));
  set(12, std::int16_t(4)), set(14, std::int16_t(16));
  const std::int64_t sizes[] = {3, 4, 3, 2};
  const double lengths[] = {1, 0.5, 0.75, 1.25}, origin[] = {10, 20, 30};
  for (std::size_t k = 0; k < 4; ++k) set(16 + 8 * k, sizes[k]), set(104 + 8 * k, lengths[k]);
  set(168, std::int64_t(544));
  set(176, 2.0), set(184, -1024.0);
  set(344, std::int32_t(qform)), set(348, std::int32_t(sform));
  for (std::size_t k = 0; k < 3; ++k) {
    set(376 + 8 * k, origin[k]);
    set(400 + 40 * k, lengths[k + 1]), set(424 + 32 * k, origin[k]);  // the rows of the sform
  }
  set(500, std::int32_t(2));
  for (std::size_t i = 0; i < 24; ++i) set(544 + 2 * i, std::int16_t(i * 13));
  return file;
}

TEST_F(Nifti, SecondVersionIsReadAsTheFirst) {
  for (const bool big_endian : {false, true})
    for (const auto& [sform, qform] : {std::pair{1, 0}, {0, 1}, {1, 1}}) {
      const Volume volume = of(nifti2(big_endian, sform, qform));
      EXPECT_EQ(volume.grid.size, (std::array<int, 3>{4, 3, 2}));
      EXPECT_EQ(volume.grid.spacing_mm, Vector3d(0.5, 0.75, 1.25));
      // RAS becomes LPS; the axes are then left-handed only if an odd number of them turns, and two do.
      EXPECT_EQ(volume.grid.origin_mm, Vector3d(-10, -20, 30));
      EXPECT_EQ(volume.grid.direction, Matrix3d(Vector3d(-1, -1, 1).asDiagonal()));
      EXPECT_EQ(volume.at(3, 2, 1), 2 * 23 * 13 - 1024);
    }
  const gzFile packed = gzopen((folder / "c.nii.gz").c_str(), "wb");
  const std::string bytes = nifti2(false, 1, 0);
  gzwrite(packed, bytes.data(), unsigned(bytes.size()));
  gzclose(packed);
  EXPECT_EQ(files::read_volume_file(folder / "c.nii.gz", {}).at(3, 2, 1), 2 * 23 * 13 - 1024);
}

TEST_F(Nifti, FaultsOfTheSecondVersionAreThoseOfTheFirst) {
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
