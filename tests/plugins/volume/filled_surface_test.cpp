// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <marrow/domain/functions.hpp>
#include <marrow/domain/volume.hpp>

#include "tests/plugins/plan/implants.hpp"

namespace filled_surface_test {

using Eigen::Vector2f, Eigen::Vector3d;

marrow::Volume filled(const marrow::Mesh& mesh, const shipped::Options& options = {}) {
  return shipped::call("volume.filled_surface", {{"mesh", shipped::item(mesh)}}, options)
      .at("volume")
      .as<marrow::Volume>();
}

TEST(FilledSurface, HoldsTheVolumeOfTheSurface) {
  const marrow::Mesh rod = implants::rod().surface;
  const marrow::Volume volume = filled(rod);
  double metal = 0;
  for (const float value : volume.values) metal += (value + 1000) / 3000 * std::pow(0.5, 3);
  EXPECT_NEAR(metal, marrow::enclosed_volume_mm3(rod), 0.003 * marrow::enclosed_volume_mm3(rod));
  EXPECT_EQ(volume.grid.frame, "implant");
  EXPECT_LT(volume.grid.count(), std::size_t(30 * 30 * 220)) << "the grid lies along the rod";
}

#ifdef WITH_NAIL
/// The attenuation of a ray across a straight nail with known bore and hole.
TEST(FilledSurface, LineIntegralsThroughANailAreThoseByHand) {
  const auto nail = shipped::call("simulate.nail", {},
                                  {{"length_mm", 80.0},
                                   {"bow_radius_mm", 1e7},
                                   {"resolution_mm", 0.4},
                                   {"hole_at_mm", std::vector<double>{40}},
                                   {"hole_turn_deg", std::vector<double>{90}}})
                        .at("mesh");
  const marrow::Value volume =
      shipped::call("volume.filled_surface", {{"mesh", nail}}, {{"spacing_mm", 0.3}}).at("volume");
  const marrow::Value projector = shipped::call("project.joseph", {{"volume", volume}}).at("projector");
  // The nail's middle is at the isocentre, seen along its hole.
  const marrow::Pose pose = implants::pose({0, 0, 0}, {0, 0, 40}, {0, 0, 0});
  const marrow::Camera camera = implants::camera(0, 0);
  const auto mm_of_metal = [&](double x_mm, double z_mm) {
    const Eigen::Vector2d pixel = project(camera, Vector3d(x_mm, 0, z_mm));
    return projector.as<marrow::RadiographProjector>().radiograph(camera, pose.world_from_model,
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
  marrow::Mesh open = implants::rod().surface;
  open.triangles.pop_back();
  EXPECT_EQ(shipped::refusal("volume.filled_surface", {{"mesh", shipped::item(open)}}),
            "volume.filled_surface: the surface is open, so it has no inside; close its holes");
  marrow::Mesh large = implants::rod().surface;
  for (Vector3d& vertex : large.vertices_mm) vertex *= 9;
  const std::string said =
      shipped::refusal("volume.filled_surface", {{"mesh", shipped::item(large)}}, {{"spacing_mm", 0.1}});
  EXPECT_EQ(said.rfind("volume.filled_surface: with spacing_mm 0.100000 the volume has ", 0), 0u) << said;
  EXPECT_NE(said.find(" million voxels, and at most 100 are allowed; take a larger spacing_mm"), std::string::npos);
}

}  // namespace filled_surface_test
