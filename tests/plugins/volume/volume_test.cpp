// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/plan/implants.hpp"

namespace marrow::test::volume_test {

using Eigen::Vector2f;

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

struct Bridged : Heard {
  explicit Bridged(const Volume& volume, const Options& options = {})
      : ct(output<Volume>("volume.bridge_metal", "volume", {{"volume", item(volume)}}, options, context)) {}
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

Volume filled(const Mesh& mesh, const Options& options = {}) {
  return output<Volume>("volume.filled_surface", "volume", {{"mesh", item(mesh)}}, options);
}

TEST(FilledSurface, HoldsTheVolumeOfTheSurface) {
  const Mesh rod = implants::rod().surface;
  const Volume volume = filled(rod);
  double metal = 0;
  for (const float value : volume.values) metal += (value + 1000) / 3000 * std::pow(0.5, 3);
  EXPECT_NEAR(metal, enclosed_volume_mm3(rod), 0.003 * enclosed_volume_mm3(rod));
  EXPECT_EQ(volume.grid.frame, "implant");
  EXPECT_LT(volume.grid.count(), std::size_t(30 * 30 * 220)) << "the grid lies along the rod";
}

#ifdef WITH_NAIL
/// The attenuation of a ray across a straight nail with known bore and hole.
TEST(FilledSurface, LineIntegralsThroughANailAreThoseByHand) {
  const auto nail = call("simulate.nail", {},
                         {{"length_mm", 80.0},
                          {"bow_radius_mm", 1e7},
                          {"resolution_mm", 0.4},
                          {"hole_at_mm", Numbers{40}},
                          {"hole_turn_deg", Numbers{90}}})
                        .at("mesh");
  const Value volume = call("volume.filled_surface", {{"mesh", nail}}, {{"spacing_mm", 0.3}}).at("volume");
  const Value projector = call("project.joseph", {{"volume", volume}}).at("projector");
  // The nail's middle is at the isocentre, seen along its hole.
  const Pose pose = implants::pose({0, 0, 0}, {0, 0, 40}, {0, 0, 0});
  const Camera camera = implants::camera(0, 0);
  const auto mm_of_metal = [&](double x_mm, double z_mm) {
    const Vector2d pixel = project(camera, Vector3d(x_mm, 0, z_mm));
    return projector.as<RadiographProjector>().radiograph(camera, pose.world_from_model,
                                                          std::vector<Vector2f>{pixel.cast<float>()})[0] /
           3.0;  // 2000 HU are three times as dense as water
  };
  EXPECT_NEAR(mm_of_metal(0, 0), 0, 0.02) << "through the hole";
  EXPECT_NEAR(mm_of_metal(0, 15), 10 - 4.8, 0.1) << "through both walls and the bore";
  EXPECT_NEAR(mm_of_metal(4, 15), 2 * std::sqrt(25.0 - 16), 0.1) << "beside the bore";
  EXPECT_NEAR(mm_of_metal(5.5, 15), 0, 0.02) << "beside the nail";
}
#endif

TEST(FilledSurface, RefusesWhatHasNoInside) {
  Mesh open = implants::rod().surface;
  open.triangles.pop_back();
  EXPECT_EQ(refusal("volume.filled_surface", {{"mesh", item(open)}}),
            "volume.filled_surface: the surface is open, so it has no inside; close its holes");
  Mesh large = implants::rod().surface;
  for (Vector3d& vertex : large.vertices_mm) vertex *= 9;
  const std::string said = refusal("volume.filled_surface", {{"mesh", item(large)}}, {{"spacing_mm", 0.1}});
  EXPECT_EQ(said.rfind("volume.filled_surface: with spacing_mm 0.100000 the volume has ", 0), 0u) << said;
  EXPECT_HAS(said, " million voxels, and at most 100 are allowed; take a larger spacing_mm");
}

}  // namespace marrow::test::volume_test
