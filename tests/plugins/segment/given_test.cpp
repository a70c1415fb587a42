// SPDX-License-Identifier: Apache-2.0
// The smooth surface of labels, against shapes whose truth is known, on grids of several kinds.
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::given_test {

using Distance = std::function<double(const Vector3d&)>;

Distance sphere(double radius_mm, const Vector3d& centre) {
  return [=](const Vector3d& p) { return (p - centre).norm() - radius_mm; };
}

Distance cylinder(double radius_mm, const Vector3d& axis) {
  const Vector3d along = axis.normalized();
  return [=](const Vector3d& p) { return (p - p.dot(along) * along).norm() - radius_mm; };
}

Grid grid_of(const std::array<int, 3>& size, const Vector3d& spacing_mm, double turn_rad = 0) {
  return analytic::grid_of(size, spacing_mm,
                           Eigen::AngleAxisd(turn_rad, Vector3d(1, -2, 3).normalized()).toRotationMatrix());
}

Volume mask_of(const Grid& grid, const Distance& distance) {
  return volume_by(grid, [&](const Vector3d& point) { return distance(point) < 0; });
}

SignedField field_by(const Inputs& inputs) { return output_list<SignedField>("segment.given", "field", inputs)[0]; }

struct Errors {
  double mean_mm = 0, rms_mm = 0, worst_mm = 0;
};

/// Distances of the mesh's vertices from the true surface, at least `margin_mm` from the ends of the label's grid.
Errors errors_of(const SignedField& field, const Distance& truth, const Grid& label_grid, double margin_mm) {
  const Mesh mesh = output<Mesh>("mesh.marching_cubes", "mesh", {{"field", item(field)}});
  Errors errors;
  double count = 0;
  for (const Vector3d& vertex : mesh.vertices_mm) {
    const Vector3d index = label_grid.index_from_point(vertex);
    bool is_inner = true;
    for (int k = 0; k < 3; ++k) {
      const double margin = margin_mm / label_grid.spacing_mm[k];
      is_inner &= index[k] > margin && index[k] < label_grid.size[std::size_t(k)] - 1 - margin;
    }
    if (!is_inner) continue;
    const double off = truth(vertex);
    errors.mean_mm += off;
    errors.rms_mm += off * off;
    errors.worst_mm = std::max(errors.worst_mm, std::abs(off));
    ++count;
  }
  EXPECT_GT(count, 1000);
  return {errors.mean_mm / count, std::sqrt(errors.rms_mm / count), errors.worst_mm};
}

struct Shape {
  std::string name;
  Distance distance;
  Grid grid;
  double mean_voxels, rms_voxels, worst_voxels;
};

class SmoothSurface : public testing::TestWithParam<Shape> {};

/// Midway between voxels, as run.program_field puts it, the rms is 0.17 to 0.20 voxels and the worst 0.5.
TEST_P(SmoothSurface, LiesWhereTheTruthIs) {
  const Shape& shape = GetParam();
  const SignedField field = field_by({{"label", per_fragment("bone", mask_of(shape.grid, shape.distance))}});
  const Errors errors = errors_of(field, shape.distance, shape.grid, 4);
  const double voxel_mm = std::cbrt(shape.grid.spacing_mm.prod());
  RecordProperty("mean_voxels", std::to_string(errors.mean_mm / voxel_mm));
  RecordProperty("rms_voxels", std::to_string(errors.rms_mm / voxel_mm));
  RecordProperty("worst_voxels", std::to_string(errors.worst_mm / voxel_mm));
  EXPECT_LT(std::abs(errors.mean_mm), shape.mean_voxels * voxel_mm) << errors.mean_mm / voxel_mm;
  EXPECT_LT(errors.rms_mm, shape.rms_voxels * voxel_mm) << errors.rms_mm / voxel_mm;
  EXPECT_LT(errors.worst_mm, shape.worst_voxels * voxel_mm) << errors.worst_mm / voxel_mm;
}

const Vector3d kBeside(0.21, -0.37, 0.11);

INSTANTIATE_TEST_SUITE_P(
    All, SmoothSurface,
    testing::Values(
        Shape{"sphere", sphere(8.3, kBeside), grid_of({30, 30, 30}, {1, 1, 1}), 0.03, 0.05, 0.25},
        Shape{"large_sphere", sphere(20.3, kBeside), grid_of({54, 54, 54}, {1, 1, 1}), 0.02, 0.04, 0.25},
        Shape{"turned", sphere(12.3, kBeside), grid_of({42, 42, 30}, {0.8, 0.8, 1.2}, 0.7), 0.03, 0.06, 0.3},
        Shape{"thick_slices", sphere(15.3, kBeside), grid_of({46, 46, 18}, {0.8, 0.8, 2.4}), 0.12, 0.2, 0.5},
        Shape{"shaft", cylinder(10.2, {0.05, 0.02, 1}), grid_of({34, 34, 60}, {1, 1, 1}), 0.03, 0.07, 0.25},
        Shape{"tilted_shaft", cylinder(10.2, {0.35, 0.1, 1}), grid_of({50, 40, 40}, {1, 1, 1}), 0.02, 0.04, 0.15},
        Shape{"thin_shaft", cylinder(4.1, {0.2, 0.1, 1}), grid_of({30, 26, 40}, {1, 1, 1}), 0.09, 0.1, 0.25}),
    [](const auto& test) { return test.param.name; });

TEST(Given, ALabelOnAnotherGridThanTheCt) {
  const Distance ball = sphere(12.3, kBeside);
  Volume ct{grid_of({70, 60, 50}, {0.7, 0.7, 0.9}, 0.4), {}};
  ct.values.assign(ct.grid.count(), 40);
  // Larger voxels, other axes, and cut to the bone with a margin of two voxels.
  const Grid grid = grid_of({21, 21, 21}, {1.4, 1.4, 1.4}, -0.9);
  const SignedField field = field_by({{"volume", item(ct)}, {"label", per_fragment("bone", mask_of(grid, ball))}});
  EXPECT_EQ(field.grid.size, ct.grid.size);
  EXPECT_EQ(field.grid.direction, ct.grid.direction);
  const Errors errors = errors_of(field, ball, ct.grid, 0);
  EXPECT_LT(std::abs(errors.mean_mm), 0.05 * 1.4) << errors.mean_mm;
  EXPECT_LT(errors.rms_mm, 0.06 * 1.4);
  EXPECT_LT(errors.worst_mm, 0.25 * 1.4);
}

TEST(Given, ALabelThatEndsWithItsGridIsCutFlat) {
  const Distance shaft = cylinder(8, {0, 0, 1});
  const Grid grid = grid_of({24, 24, 21}, {1, 1, 1});  // z from -10 to 10
  const SignedField field = field_by({{"label", per_fragment("bone", mask_of(grid, shaft))}});
  const Mesh mesh = output<Mesh>("mesh.marching_cubes", "mesh", {{"field", item(field)}});
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(extent(mesh).min().z(), -10.5, 1e-3);
  EXPECT_NEAR(extent(mesh).max().z(), 10.5, 1e-3);
}

/// The centre of every voxel stays on its side.
TEST(Given, NoVoxelChangesItsSide) {
  std::mt19937 random(5);
  Volume mask{grid_of({20, 18, 16}, {0.7, 0.9, 1.3}), {}};
  for (std::size_t i = 0; i < mask.grid.count(); ++i) mask.values.push_back(random() % 3 == 0);
  const SignedField field = field_by({{"label", per_fragment("bone", mask)}});
  for (int z = 0; z < 16; ++z)
    for (int y = 0; y < 18; ++y)
      for (int x = 0; x < 20; ++x)
        ASSERT_EQ(field.at(x + 7, y + 7, z + 7) < 0, mask.at(x, y, z) == 1) << x << " " << y << " " << z;
}

TEST(Given, ASurfaceWithAndWithoutCt) {
  const Mesh ball = analytic::mesh_of({{{3, -2, 40}, {8, 10, 30}}});
  Volume ct{grid_of({60, 60, 110}, {0.8, 0.8, 0.8}), {}};
  ct.grid.origin_mm += Vector3d(3, -2, 40);
  ct.values.assign(ct.grid.count(), 40);
  const double truth_mm3 = enclosed_volume_mm3(ball);
  for (const bool has_ct : {true, false}) {
    Inputs inputs{{"surface", per_fragment("bone", ball)}};
    if (has_ct) inputs["volume"] = item(ct);
    const Mesh found = output<Mesh>("mesh.marching_cubes", "mesh", {{"field", item(field_by(inputs))}});
    EXPECT_NEAR(enclosed_volume_mm3(found), truth_mm3, 0.005 * truth_mm3) << has_ct;
  }
}

TEST(Given, WhatWasSegmentedIsPassedOn) {
  SignedField field{grid_of({2, 2, 2}, {1, 1, 1}), {-1, 1, 1, 1, 1, 1, 1, 1}};
  EXPECT_EQ(field_by({{"segmented", per_fragment("bone", field)}}).values_mm, field.values_mm);
}

TEST(Given, Faults) {
  const Mesh ball = analytic::mesh_of({{{0, 0, 0}, {8, 8, 8}}});
  const Volume mask = mask_of(grid_of({20, 20, 20}, {1, 1, 1}), sphere(8, kBeside));
  const auto said = [](const Inputs& inputs) { return MESSAGE_OF(field_by(inputs)); };
  EXPECT_EQ(said({}), "nothing gives the fragments: neither a segmentation from seeds nor labels nor surfaces");
  EXPECT_EQ(said({{"label", per_fragment("bone", mask)}, {"surface", per_fragment("bone", ball)}}),
            "a fragment is given by a label or by a surface; got both");
  Mesh open = ball;
  open.triangles.pop_back();
  EXPECT_EQ(said({{"surface", per_fragment("bone", open)}}),
            "the surface of 'bone' is open, so it has no inside; close its holes");
  Volume elsewhere{grid_of({9, 9, 9}, {1, 1, 1}), std::vector<float>(729, 40)};
  elsewhere.grid.origin_mm += Vector3d(500, 0, 0);
  EXPECT_EQ(said({{"volume", item(elsewhere)}, {"label", per_fragment("bone", mask)}}),
            "fragment 'bone' has no voxel of the CT: its label or surface lies elsewhere. Were they made from another "
            "scan, or is the surface in another unit or frame (RAS)?");
  Volume nothing = mask;
  nothing.values.assign(nothing.grid.count(), 0);
  EXPECT_EQ(said({{"label", per_fragment("bone", nothing)}}), "mask: no voxel is inside");
}

}  // namespace marrow::test::given_test
