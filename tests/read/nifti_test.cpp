// SPDX-License-Identifier: Apache-2.0
// NIfTI files that say twice where they lie: by an sform and by a qform.
#include <gtest/gtest.h>

#include <cmath>

#include "marrow/toolbox/files/volume_file.hpp"
#include "read/files.hpp"
#include "read/hostile.hpp"
#include "read/itk_files.hpp"

namespace nifti_test {

using namespace marrow::test;

template <class T>
std::string number(T value) {
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

std::string replaced(std::string bytes, std::size_t at, const std::string& by) {
  return bytes.replace(at, by.size(), by);
}

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

}  // namespace nifti_test
