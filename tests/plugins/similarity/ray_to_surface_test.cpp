// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Eigenvalues>

#include "tests/plugins/similarity/blob_scene.hpp"

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
            "view 'frontal': no ray through an edge passes within 4 mm of the model's surface; "
            "view 'lateral': no ray through an edge passes within 4 mm of the model's surface");
  const Value masked =
      each_view(view_of("frontal", c_arm(0)), view_of("lateral", c_arm(90), {}, nothing_shown(c_arm(90))));
  EXPECT_EQ(cost(with(inputs(), {{"views", masked}}))->silent_views(placed({1, 0, 0})),
            Strings{"view 'lateral': it has no edge that is inside the mask and belongs to this bone"});
}

}  // namespace marrow::test::ray_to_surface_test
