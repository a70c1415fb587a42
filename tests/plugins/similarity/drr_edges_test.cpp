// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>

#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::drr_edges_test {

using blob_scene::at;

constexpr const char* kNode = "similarity.drr_edges";

/// A wall through (100 + x, 80) with this normal. Rays beyond it cross it. Its border is blurred by an error function.
Value wall(const DrawnRadiograph::Region& region, const Vector2d& normal) {
  return function<RadiographProjector>(
      std::make_shared<const DrawnRadiograph>(region, [=](const Vector2d& pixel, const RigidTransform& pose) {
        const double across_px = normal.dot(pixel - Vector2d(100 + pose.translation_mm.x(), 80));
        return 20 + 20 * std::erf(across_px / (std::sqrt(2.0) * 2.5));
      }));
}
PixelGrid beside_the_wall(const RigidTransform& pose) {
  return std::abs(pose.translation_mm.x()) < 60 ? PixelGrid{60, 20, 1, 80, 130} : PixelGrid{};
}

/// An upright wall that is brighter on the left, as its edges are.
Inputs inputs(const EdgeMap& edges) {
  return {{"projector", wall(beside_the_wall, {1, 0})},
          {"views", each_view(blob_scene::view_of())},
          {"edges", per_view("frontal", edges)}};
}
Inputs inputs(double u_px, float direction = -1) { return inputs(upright_edges(200, 170, u_px, direction, 0, 170)); }

double value(const Inputs& inputs, double x, const Options& options = {{"pixel_step", std::int64_t(1)}}) {
  return cost_by(kNode, inputs, with({{"reach_px", 10.0}}, options))->value(at(x, 0));
}
double loss(double distance_px) { return std::sqrt(1 + distance_px * distance_px) - 1; }

TEST(DrrEdges, FindsTheRadiographsEdgesBetweenPixels) {
  for (const std::int64_t step : {1, 2, 3})
    for (const double x : {-4.0, -1.3, 0.0, 0.45, 2.0})
      EXPECT_NEAR(value(inputs(100.4), x, {{"pixel_step", step}}), loss(x - 0.4), 0.05) << step << " " << x;
}

TEST(DrrEdges, DistancesAreAcrossAnObliqueEdge) {
  EdgeMap map{200, 170, {}};
  const Vector2d normal(std::cos(radians(30)), std::sin(radians(30)));
  for (int v = 10; v < 160; ++v)
    map.pixels.push_back(
        {float(100 - (v - 80) * normal.y() / normal.x()), float(v), float(-normal.x()), float(-normal.y()), 1});
  const Inputs in = with(inputs(map), {{"projector", wall(
                                                         [](const auto&) {
                                                           return PixelGrid{70, 50, 1, 60, 60};
                                                         },
                                                         normal)}});
  for (const double x : {-4.0, 0.0, 2.0}) EXPECT_NEAR(value(in, x), loss(x * normal.x()), 0.05) << x;
}

TEST(DrrEdges, DistancesAlongAnEdgeBeginBeyondAPixel) {
  // A single edge pixel at (101, 80). The wall's points in rows 15 to 155 lie 1 px away across the edge, and up to 75
  // px along it.
  double expected = 0;
  for (int v = 15; v <= 155; ++v)
    expected += loss(std::min(10.0, std::hypot(1, std::max(0.0, std::abs(v - 80) - 1.5)))) / 141;
  EXPECT_NEAR(value(inputs(EdgeMap{200, 170, {{101, 80, -1, 0, 1}}}), 0), expected, 0.01);
}

TEST(DrrEdges, WhatDoesNotMatchIsTheWorst) {
  EXPECT_NEAR(value(inputs(130), 0), loss(10), 1e-9) << "beyond the reach";
  EXPECT_NEAR(value(inputs(100, 1), 0), loss(10), 1e-9) << "edges of the other direction";
  EXPECT_NEAR(value(inputs(100), 80), loss(10), 1e-9) << "out of view";
}

TEST(DrrEdges, BlurReachesBeyondTheRegion) {
  // A square. The region ends at the square, or further out.
  const auto value_with = [](int around_px, double blur_px) {
    const auto square = std::make_shared<const DrawnRadiograph>(
        PixelGrid{80.0 - around_px, 60.0 - around_px, 1, 40 + 2 * around_px, 40 + 2 * around_px},
        [](const Vector2d& p, const auto&) {
          return p.x() >= 80 && p.x() < 120 && p.y() >= 60 && p.y() < 100 ? 10 : 0;
        });
    return value(with(inputs(81), {{"projector", function<RadiographProjector>(square)}}), 0, {{"blur_px", blur_px}});
  };
  for (const double blur_px : {1.5, 4.0}) EXPECT_NEAR(value_with(0, blur_px), value_with(30, blur_px), 1e-3) << blur_px;
}

TEST(DrrEdges, AnotherFragmentsEdgesDoNotCount) {
  // Only the edges of the square's left border, which the wall meets too.
  const Inputs in = inputs(upright_edges(200, 170, 101, -1, 60, 90));
  EXPECT_LT(value(in, 1), loss(10) - 1);
  Inputs told = blob_scene::beside_another(in, blob_scene::square_outline(), blob_scene::square_outline());
  told["outline"] = told.at("projector");
  told["projector"] = in.at("projector");
  EXPECT_NEAR(value(told, 1), loss(10), 1e-9);
  told.erase("outline");
  EXPECT_EQ(refusal(kNode, told),
            "there are other fragments, but it is not known which of them is this one; wire 'outline', the one that "
            "draws this fragment");
}

TEST(DrrEdges, Levels) {
  const auto cost = cost_by(kNode, inputs(100)), coarse = cost->at_level({4, 20, 4});
  EXPECT_NEAR(coarse->value(at(80, 0)), loss(20), 1e-9);
  EXPECT_LT(coarse->value(at(0, 0)), 0.1);
  EXPECT_NEAR(coarse->value(at(12, 0)), loss(12), 0.5);
}

TEST(DrrEdges, SaysWhatIsEmpty) {
  const auto said = [](const Inputs& inputs, double x) {
    return cost_by(kNode, inputs, {{"reach_px", 10.0}})->nothing_compared(at(x, 0));
  };
  EXPECT_EQ(said(inputs(100), 5), "");
  EXPECT_EQ(said(inputs(130), 0), "view 'frontal': no edge lies within 10 px of the radiograph's edges");
  EXPECT_EQ(said(inputs(100), 80),
            "view 'frontal': it shows no edge of the radiograph, which is empty or outside the image");
  const View masked = blob_scene::with_mask(blob_scene::view_of(), nothing_shown(blob_scene::camera()));
  EXPECT_EQ(said(with(inputs(100), {{"views", each_view(masked)}}), 0),
            "view 'frontal': no edge of the radiograph lies inside image and mask");
}

}  // namespace marrow::test::drr_edges_test

namespace marrow::test::ray_to_surface_test {

constexpr const char* kNode = "similarity.ray_to_surface";
constexpr double kRadius_mm = 15, kWorst = 16.0 / 6;

/// Signed distance to a ball and to a smaller one. Rays that touch the larger ball run through the smaller one.
/// Clamped, as segmentations do it.
SignedField field(const Vector3d& spacing_mm = {1, 1, 1}) {
  return field_by(grid_at({60, 70, 76}, {-28, -26, -28}, spacing_mm), [](const Vector3d& p) {
    return std::clamp(std::min(p.norm() - kRadius_mm, (p - Vector3d(8, 18, 20)).norm() - 8), -6.0, 6.0);
  });
}

/// Pixels whose rays touch the larger ball. Their directions are the normals of its outline, or the opposite.
EdgeMap edges_of_ball(const Camera& camera, float side) {
  const Vector3d source = source_position_mm(camera), n = source.normalized(), a = n.unitOrthogonal(), b = n.cross(a);
  const double share = kRadius_mm / source.norm();
  EdgeMap map{camera.width_px, camera.height_px, {}};
  for (int i = 0; i < 360; ++i) {
    const double angle = radians(i);
    const Vector3d normal = share * n + std::sqrt(1 - share * share) * (std::cos(angle) * a + std::sin(angle) * b);
    const Vector2d pixel = project(camera, kRadius_mm * normal),
                   outward = (project(camera, (kRadius_mm + 0.01) * normal) - pixel).normalized();
    map.pixels.push_back(
        {float(pixel.x()), float(pixel.y()), side * float(outward.x()), side * float(outward.y()), 100});
  }
  return map;
}

Inputs inputs(float side = 1) {
  return {{"field", item(field())},
          {"views", each_view(view_of("frontal", c_arm(0)), view_of("lateral", c_arm(90)))},
          {"edges", per_view("frontal", edges_of_ball(c_arm(0), side), "lateral", edges_of_ball(c_arm(90), side))}};
}
std::shared_ptr<const Cost> cost(const Inputs& in = inputs(), const Options& options = {}) {
  return cost_by(kNode, in, options);
}
const RigidTransform kTruth = placed({0, 0, 0}), kOff = placed({0.8, -0.6, 0.7});

double tukey(double d, double reach) {
  return d < reach ? reach * reach / 6 * (1 - std::pow(1 - d * d / (reach * reach), 3)) : reach * reach / 6;
}

TEST(RayToSurface, IsTheDistanceThatOneComputesByHand) {
  const auto made = cost(inputs(), {{"ray_step", std::int64_t(1)}, {"reach_mm", 5.0}});
  EXPECT_NEAR(made->value(kTruth), 0, 2e-3) << "touches all rays, up to the voxels";
  // A shift s along the axis of the frontal view hardly changes this view. The lateral view sees it from the side: a
  // ray at an angle a to the shift passes the surface at a distance of s cos a.
  const double s = 1.5;
  double lateral = 0, frontal = 0;
  for (int i = 0; i < 360; ++i) {
    lateral += tukey(s * std::abs(std::cos(radians(i))), 5) / 360;
    frontal += tukey(kRadius_mm * s / 600, 5) / 360;
  }
  EXPECT_NEAR(made->value(placed({0, s, 0})), 0.5 * (lateral + frontal), 0.02);
}

TEST(RayToSurface, WhatIsFarOrOfTheOtherDirectionOrNoNumberIsTheWorst) {
  const auto made = cost();
  EXPECT_NEAR(made->value(placed({200, 0, 0})), kWorst, 1e-12);
  EXPECT_NEAR(made->value(placed({0, -2000, 0})), kWorst, 1e-12) << "behind a source";
  EXPECT_NEAR(cost(inputs(-1))->value(kTruth), kWorst, 0.06)
      << "but for a few rays that touch the smaller ball from the other side";
  for (const double wrong : {std::nan(""), HUGE_VAL}) {
    EXPECT_NEAR(made->value(placed({wrong, 0, 0})), kWorst, 1e-12);
    RigidTransform turned = kTruth;
    turned.rotation.setConstant(wrong);
    EXPECT_NEAR(made->value(turned), kWorst, 1e-12);
  }
}

TEST(RayToSurface, NothingIsReadBeyondTheField) {
  // The field ends 1 mm before the larger ball does. Voxels are stored row after row: the first voxel of a row, which
  // has this distance, follows the last one of the row before.
  const auto value = [](float first_column_mm) {
    const SignedField whole = field();
    Grid grid = whole.grid;
    grid.size[0] = 43;
    const SignedField cut{grid, at_each_index(grid, [&](const Vector3d& i) {
                            return i.x() == 0 ? first_column_mm : whole.at(int(i.x()), int(i.y()), int(i.z()));
                          })};
    return cost(with(inputs(), {{"field", item(cut)}}))->value(kTruth);
  };
  EXPECT_NEAR(value(5.9f), value(4.1f), 1e-6);
}

TEST(RayToSurface, KnowsItsDerivatives) {
  const auto made = cost();
  const RigidTransform pose = placed(kOff.translation_mm, {0.02, 0.03, -0.02});
  const FragmentFrame frame{Vector3d(1, 2, 3), rotation_from_vector({0.3, 0.2, -0.1})};
  const auto value = [&](const RigidTransform& from, const FragmentFrame& about, int axis, double by) {
    return made->value(marrow::moved(from, about, by * Vector6d::Unit(axis)));
  };
  const auto about = made->expansion(pose, frame);
  ASSERT_TRUE(about.has_value());
  EXPECT_NEAR(about->value, made->value(pose), 1e-12);
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? 5e-3 : 0.1;
    EXPECT_NEAR(about->gradient[k], (value(pose, frame, k, h) - value(pose, frame, k, -h)) / (2 * h),
                k < 3 ? 0.08 : 0.02)
        << k;
  }
  EXPECT_GE(about->curvature.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12);
  // Near the minimum the curvature is that of the cost.
  const auto bottom = made->expansion(kTruth, {});
  const double h = 0.3;
  for (int k = 3; k < 6; ++k)
    EXPECT_NEAR(bottom->curvature(k, k),
                (value(kTruth, {}, k, h) - 2 * value(kTruth, {}, k, 0) + value(kTruth, {}, k, -h)) / (h * h),
                0.1 * bottom->curvature(k, k))
        << k;
}

TEST(RayToSurface, DerivativesDoNotDependOnTheSizesOfVoxels) {
  const auto other = cost(with(inputs(), {{"field", item(field({0.8, 1, 1.25}))}}));
  const auto expected = cost()->expansion(kOff, {}), found = other->expansion(kOff, {});
  EXPECT_LT((found->gradient - expected->gradient).tail<3>().norm(), 0.02 * expected->gradient.tail<3>().norm());
}

TEST(RayToSurface, LevelsUseFewerRays) {
  const auto fine = cost(), coarse = fine->at_level({6, 30, 0});
  EXPECT_LT(coarse->value(kTruth), 0.01);
  EXPECT_NEAR(coarse->value(placed({300, 0, 0})), 6.0 * 6 / 6, 1e-9)
      << "30 px are 10.5 mm at the isocentre, but the field ends at 6 mm";
}

TEST(RayToSurface, AnotherFragmentsEdgesDoNotCount) {
  const Inputs alone = inputs();
  List<EdgeMap> more;
  for (const char* view : {"frontal", "lateral"})
    more.add(view,
             together(*alone.at("edges").as_list<EdgeMap>().find(view), upright_edges(512, 512, 101, -1, 60, 90, 100)));
  const Inputs both = with(alone, {{"edges", list(more, "view")}});
  const auto value = [](const Inputs& in) { return cost(in, {{"ray_step", std::int64_t(1)}})->value(kOff); };
  EXPECT_GT(value(both), value(alone) + 0.1);
  Inputs told = blob_scene::beside_another(both, blob_scene::square_outline(), blob_scene::square_outline());
  EXPECT_EQ(value(told), value(alone));
  told.erase("projector");
  EXPECT_EQ(refusal(kNode, told),
            "there are other fragments, but it is not known which of them is this one; wire 'projector', the one that "
            "draws this fragment");
}

TEST(RayToSurface, SaysWhatIsWrong) {
  EXPECT_EQ(refusal(kNode, with(inputs(), {{"edges", {}}})),
            "there are 2 views, but edge maps of 0; give the edges of each view");
  SignedField outside = field();
  outside.values_mm.assign(outside.values_mm.size(), 6);
  EXPECT_EQ(refusal(kNode, with(inputs(), {{"field", item(outside)}})),
            "the field has no inside, so no ray can touch its surface; check the segmentation");
}

TEST(RayToSurface, SaysWhatIsEmpty) {
  const auto made = cost();
  EXPECT_EQ(made->nothing_compared(placed({1, 0, 0})), "");
  EXPECT_EQ(made->nothing_compared(placed({200, 0, 0})),
            "view 'frontal': no ray through an edge passes within 4 mm of the model's surface; view 'lateral': no ray "
            "through an edge passes within 4 mm of the model's surface");
  const Value masked =
      each_view(view_of("frontal", c_arm(0)), view_of("lateral", c_arm(90), {}, nothing_shown(c_arm(90))));
  EXPECT_EQ(cost(with(inputs(), {{"views", masked}}))->silent_views(placed({1, 0, 0})),
            Strings{"view 'lateral': it has no edge that is inside the mask and belongs to this bone"});
}

}  // namespace marrow::test::ray_to_surface_test

// A box of metal in an image of two grey values, one in its shadow and one beside it.
namespace marrow::test::silhouette_overlap_test {

/// 2 pixels a mm at the box, whose shadow is 80 x 60 pixels around (100, 100). The box lies x mm beside it.
double cost(double inside, double outside, const std::string& polarity, double x_mm) {
  View view = even_view("first", pinhole(2000, 200, 200, {{100, 100}}), outside);
  view.image.pixels(cv::Rect(60, 70, 81, 61)).setTo(inside);
  return cost_by("similarity.silhouette_overlap",
                 {{"model", item(box({0, 0, 0}, {40, 30, 0.02}))}, {"views", each_view(view)}},
                 {{"polarity", polarity}, {"band_px", 20.0}})
      ->value(placed({x_mm, 0, 1000}));
}

TEST(SilhouetteOverlap, IsWholeWhereTheMetalIs) {
  struct Metal {
    std::string polarity;
    double inside, outside;
  };
  for (const auto& [polarity, inside, outside] :
       {Metal{"dark", 10, 200}, Metal{"bright", 200, 10}, Metal{"either", 10, 200}, Metal{"either", 200, 10}}) {
    double before = cost(inside, outside, polarity, 0);
    EXPECT_NEAR(before, 0, 0.03);
    for (const double off_mm : {2.0, 5.0, 10.0, 15.0}) {
      const double value = cost(inside, outside, polarity, off_mm);
      EXPECT_GT(value, before) << polarity << ' ' << off_mm;
      before = value;
    }
  }
}

TEST(SilhouetteOverlap, IsTheWorstWithoutMetalOfThePolarity) {
  EXPECT_EQ(cost(200, 10, "dark", 0), 1);
  EXPECT_EQ(cost(10, 200, "bright", 0), 1);
  EXPECT_EQ(cost(90, 90, "either", 0), 1);
}

// Shifted by 10 mm, 20 pixels: of the silhouette's 80 columns, 60 are on metal. The band adds 20 pixels around, with
// round corners. The squared Matthews correlation follows from the four counts.
TEST(SilhouetteOverlap, IsTheMatthewsCorrelation) {
  const double in = 80 * 60, band = 2 * 20 * (80 + 60) + 3.14159 * 20 * 20, metal_in = 60 * 60, metal_out = 20 * 60;
  const double all = in + band, metal = metal_in + metal_out;
  const double phi =
      (metal_in * (band - metal_out) - (in - metal_in) * metal_out) / std::sqrt(in * band * metal * (all - metal));
  EXPECT_NEAR(cost(10, 200, "dark", 10), 1 - phi * phi, 0.02);
}

}  // namespace marrow::test::silhouette_overlap_test
