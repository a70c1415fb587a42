// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::bridge_metal_test {

/// 24 x 24 voxels of 1 mm in 30 slices of 1.2 mm. The value of each slice is the square of its number, so
/// that an interpolated slice shows.
Volume ct() {
  Volume ct;
  ct.grid.size = {24, 24, 30};
  ct.grid.spacing_mm = {1, 1, 1.2};
  for (int z = 0; z < 30; ++z) ct.values.insert(ct.values.end(), 24 * 24, float(z * z));
  return ct;
}
/// Metal in these slices, in the rows 8 to 11 and the columns from 4 on.
void add_metal(Volume& ct, int first, int last, int columns) {
  for (int z = first; z <= last; ++z)
    for (int y = 8; y < 12; ++y)
      for (int x = 4; x < 4 + columns; ++x) ct.values[ct.grid.offset(x, y, z)] = 3071;
}

struct Bridged {
  explicit Bridged(const Volume& volume, const Options& options = {}) {
    Context::Hooks hooks;
    hooks.log = [this](std::string_view text, LogLevel) { lines.emplace_back(text); };
    ct = output<Volume>("volume.bridge_metal", "volume", {{"volume", item(volume)}}, options, Context(hooks));
  }
  Strings lines;
  Volume ct;
};

TEST(BridgeMetal, ReplacesTheSlicesOfAScrewByWhatLiesBetween) {
  Volume before = ct();
  add_metal(before, 5, 25, 4);    // a plate
  add_metal(before, 14, 15, 16);  // a screw
  const Bridged run(before);
  for (int z = 0; z < 30; ++z)
    for (const auto& [x, y] : {std::pair(0, 0), std::pair(5, 9), std::pair(15, 9)}) {
      // From slice 12 to slice 17, because one neighbour at each side is replaced too.
      const float expected =
          z < 13 || z > 16 ? before.at(x, y, z)
                           : before.at(x, y, 12) + float(z - 12) / 5 * (before.at(x, y, 17) - before.at(x, y, 12));
      EXPECT_NEAR(run.ct.at(x, y, z), expected, 1e-3) << x << " " << y << " " << z;
    }
  EXPECT_EQ(run.lines, Strings{"slices 13 to 16 (z = 15.6 to 19.2 mm) show long metal, and are bridged"});
}

TEST(BridgeMetal, ReplacesTheSlicesOfAScrewWithoutAPlate) {
  // By hand: slice 14 becomes the mean of 12^2 and 16^2.
  Volume one = ct(), two = ct();
  add_metal(one, 14, 14, 16);
  add_metal(two, 7, 8, 16);
  add_metal(two, 20, 22, 14);
  const Bridged run(one);
  EXPECT_EQ(run.lines, Strings{"slices 13 to 15 (z = 15.6 to 18.0 mm) show long metal, and are bridged"});
  EXPECT_NEAR(run.ct.at(10, 9, 14), 0.5 * 144 + 0.5 * 256, 1e-3);
  EXPECT_EQ(run.ct.at(10, 9, 12), 144);
  const Bridged both(two);
  EXPECT_EQ(both.lines, (Strings{"slices 6 to 9 (z = 7.2 to 10.8 mm) show long metal, and are bridged",
                                 "slices 19 to 23 (z = 22.8 to 27.6 mm) show long metal, and are bridged"}));
  Volume clip = ct();
  add_metal(clip, 14, 16, 6);
  EXPECT_EQ(Bridged(clip).ct.values, clip.values) << "a clip of 6 mm makes no streaks along a bone";
}

TEST(BridgeMetal, LeavesACtWithoutMetalAsItIs) {
  EXPECT_EQ(Bridged(ct()).ct.values, ct().values);
  Volume plate = ct();
  add_metal(plate, 5, 25, 4);
  const Bridged run(plate);
  EXPECT_EQ(run.ct.values, plate.values) << "a plate alone lies in all slices alike";
  EXPECT_TRUE(run.lines.empty());
  Volume noise = ct();
  for (int y = 2; y < 22; y += 2) noise.values[noise.grid.offset(10, y, 20)] = 3071;
  EXPECT_EQ(Bridged(noise).ct.values, noise.values) << "single voxels are no metal";
}

TEST(BridgeMetal, SaysWhatItCannotBridge) {
  Volume end = ct();
  add_metal(end, 5, 29, 4);
  add_metal(end, 28, 29, 16);
  const Bridged at_end(end);
  EXPECT_EQ(at_end.ct.values, end.values);
  EXPECT_EQ(at_end.lines, Strings{"slices 27 to 29 (z = 32.4 to 34.8 mm) show long metal at the end "
                                  "of the CT, so there is nothing to bridge them from"});
  Volume wide = ct();
  add_metal(wide, 2, 27, 4);
  add_metal(wide, 10, 18, 16);
  const Bridged too_long(wide, {{"longest_mm", 10.0}});
  EXPECT_EQ(too_long.ct.values, wide.values);
  EXPECT_EQ(
      too_long.lines,
      Strings{
          "slices 9 to 19 (z = 10.8 to 22.8 mm) show long metal over more than longest_mm, so they stay as they are"});
  EXPECT_NE(Bridged(wide).ct.values, wide.values);
}

TEST(BridgeMetal, RefusesADamagedCt) {
  Volume damaged = ct();
  damaged.values.pop_back();
  EXPECT_NE(refusal("volume.bridge_metal", {{"volume", item(damaged)}}), "");
}

}  // namespace marrow::test::bridge_metal_test
