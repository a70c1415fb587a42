// SPDX-License-Identifier: Apache-2.0
// NIfTI files whose headers lie: types, places, lengths, units and directions.
#include <zlib.h>

#include "tests/plugins/read/hostile_volumes.hpp"

namespace hostile_nifti_test {

using namespace hostile_volumes;
using namespace marrow::test;

TEST_F(Hostile, NiftiWhoseTypeAndBitsDisagree) {
  const std::string bytes = good("a.nii");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(16)),
         "says that samples are of type 16, which have 32 bits, and that they have 16 bits");
  expect("b.nii", replaced(bytes, 72, number<std::int16_t>(8)),
         "type 4, which have 16 bits, and that they have 8 bits");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(1536)), "of type 1536, which is not read");
  expect("b.nii", replaced(bytes, 70, number<std::int16_t>(32)), "of type 32, which is not read");
}

TEST_F(Hostile, NiftiWhosePlacesAndLengthsAreNone) {
  const std::string bytes = good("a.nii");
  for (const float place : {std::nanf(""), HUGE_VALF, -1.f, 0.f, 352.5f, 1e30f})
    expect("b.nii", replaced(bytes, 108, number(place)), "samples begin at byte");
  expect("b.nii", replaced(bytes, 80, number(std::nanf(""))), "is not a positive length");
  expect("b.nii", replaced(bytes, 80, number(-1.f)), "is not a positive length");
  expect("b.nii", replaced(bytes, 112, number(HUGE_VALF)), "scales samples by a number that is not finite");
  expect("b.nii", replaced(bytes, 42, number<std::int16_t>(-8)), "gives a size of -8");
  expect("b.nii", replaced(bytes, 40, number<std::int16_t>(9)), "tells of 9 dimensions");
  expect("b.nii", replaced(bytes, 46, number<std::int16_t>(6)),
         "is cut off or damaged: 576 bytes of samples expected, got 480");
  expect("b.nii", replaced(bytes, 344, "ni1"), "is not a NIfTI file with its samples in it");
}

TEST_F(Hostile, NiftiSaysWhereItLies) {
  std::string bytes = replaced(good("a.nii"), 254, number<std::int16_t>(0));  // no sform: by its quaternion
  put(folder / "b.nii", bytes);
  EXPECT_LT((volume_at(folder / "b.nii").grid.direction - Eigen::Matrix3d::Identity()).norm(), 1e-6);
  bytes = replaced(replaced(good("a.nii"), 252, number<std::int16_t>(0)), 284, number(0.5f));  // sform alone, sheared
  expect("b.nii", bytes, "by a matrix that is sheared or damaged");
}

TEST_F(Hostile, BombIsRefusedBeforeItIsUnpacked) {
  std::string header = good("a.nii").substr(0, 352);
  header = replaced(replaced(header, 70, number<std::int16_t>(2)), 72, number<std::int16_t>(8));
  for (const int at : {42, 44, 46}) header = replaced(header, std::size_t(at), number<std::int16_t>(400));
  const gzFile file = gzopen((folder / "bomb.nii.gz").c_str(), "wb9");
  gzwrite(file, header.data(), unsigned(header.size()));
  const std::vector<char> zeros(1 << 20);
  for (int i = 0; i < 62; ++i) gzwrite(file, zeros.data(), unsigned(zeros.size()));
  gzclose(file);
  ASSERT_LT(std::filesystem::file_size(folder / "bomb.nii.gz"), 70000u);
  EXPECT_REFUSED(volume_at(folder / "bomb.nii.gz"), "bomb.nii.gz",
                 "its header claims 400 x 400 x 400 samples, but the file has only");
}

TEST_F(Hostile, NiftiInOtherUnitsLiesWhereItSays) {
  ItkGrid<std::int16_t> grid = stack();
  for (const auto& [unit, scale] : {std::pair{1, 1e3}, std::pair{3, 1e-3}}) {
    grid.spacing = {0.5 / scale, 0.75 / scale, 1.25 / scale};
    grid.origin = {10 / scale, 20 / scale, 30 / scale};
    write_itk(folder / "a.nii", grid);
    const std::string bytes = replaced(bytes_of(folder / "a.nii"), 123, std::string(1, char(unit)));
    for (const bool by_sform : {true, false}) {
      put(folder / "b.nii", replaced(bytes, by_sform ? 252 : 254, number<std::int16_t>(0)));
      const marrow::Grid read = volume_at(folder / "b.nii").grid;
      EXPECT_LT((read.spacing_mm - Eigen::Vector3d(0.5, 0.75, 1.25)).norm(), 1e-6) << unit;
      EXPECT_LT((read.origin_mm - Eigen::Vector3d(10, 20, 30)).norm(), 1e-5) << unit;
    }
  }
}

TEST_F(Hostile, NiftiThatDoesNotSayWhichSideIsLeft) {
  expect("b.nii", replaced(replaced(good("a.nii"), 252, number<std::int16_t>(0)), 254, number<std::int16_t>(0)),
         "does not say which axis is left or right, front or back, up or down (qform_code and sform_code are 0)");
}

TEST_F(Hostile, NiftiThatSaysTwiceHowLargeVoxelsAre) {
  const std::string bytes = replaced(good("a.nii"), 252, number<std::int16_t>(0));  // by its sform
  expect("b.nii", replaced(bytes, 88, number(1.5f)),
         "says twice how large a voxel is along axis 3: 1.000000 mm by its sform, 1.500000 mm by its pixdim");
  put(folder / "b.nii", replaced(bytes, 88, number(1.0005f)));
  EXPECT_EQ(volume_at(folder / "b.nii").grid.spacing_mm[2], 1);
}

}  // namespace hostile_nifti_test
