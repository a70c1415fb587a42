// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/plan/implants.hpp"

namespace marrow::test::filled_surface_test {

using Eigen::Vector2f;

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
  EXPECT_NE(said.find(" million voxels, and at most 100 are allowed; take a larger spacing_mm"), std::string::npos);
}

}  // namespace marrow::test::filled_surface_test
