// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <marrow/domain/features.hpp>

#include "other_fragment.hpp"
#include "shipped.hpp"
#include "tests/plugins/project/shapes.hpp"

namespace ray_to_surface_test {

using marrow::Cost;
using marrow::RigidTransform;

constexpr double kRadius_mm = 15;

/// Signed distance to a ball and to a smaller one. Rays that touch the larger ball run through the smaller one.
/// Clamped, as segmentations do it.
double distance_mm(const Eigen::Vector3d& p) {
  return std::clamp(std::min(p.norm() - kRadius_mm, (p - Eigen::Vector3d(8, 18, 20)).norm() - 8), -6.0, 6.0);
}

marrow::SignedField field(const Eigen::Vector3d& spacing_mm = {1, 1, 1}) {
  marrow::SignedField field;
  field.grid.size = {60, 70, 76};
  field.grid.spacing_mm = spacing_mm;
  field.grid.origin_mm = {-28, -26, -28};
  for (int z = 0; z < 76; ++z)
    for (int y = 0; y < 70; ++y)
      for (int x = 0; x < 60; ++x)
        field.values_mm.push_back(float(distance_mm(field.grid.point_from_index({double(x), double(y), double(z)}))));
  return field;
}

/// Pixels whose rays touch the larger ball. Their directions are the normals of its outline.
marrow::EdgeMap edges_of_ball(const marrow::Camera& camera) {
  const Eigen::Vector3d source = marrow::source_position_mm(camera), n = source.normalized(), a = n.unitOrthogonal(),
                        b = n.cross(a);
  const double share = kRadius_mm / source.norm();
  marrow::EdgeMap map{camera.width_px, camera.height_px, {}};
  for (int i = 0; i < 360; ++i) {
    const double angle = marrow::radians(i);
    const Eigen::Vector3d normal =
        share * n + std::sqrt(1 - share * share) * (std::cos(angle) * a + std::sin(angle) * b);
    const Eigen::Vector2d pixel = marrow::project(camera, kRadius_mm * normal),
                          outward = (marrow::project(camera, (kRadius_mm + 0.01) * normal) - pixel).normalized();
    map.pixels.push_back({float(pixel.x()), float(pixel.y()), float(outward.x()), float(outward.y()), 100});
  }
  return map;
}

shipped::Inputs inputs(bool turned_edges = false) {
  marrow::List<marrow::View> views;
  marrow::List<marrow::EdgeMap> edges;
  for (const double angle : {0.0, 90.0}) {
    const std::string name = angle > 0 ? "lateral" : "frontal";
    views.add(name, marrow::View{name, {}, shapes::c_arm(angle), {}});
    marrow::EdgeMap map = edges_of_ball(views[views.size() - 1].camera);
    if (turned_edges)
      for (auto& edge : map.pixels) edge.direction_u = -edge.direction_u, edge.direction_v = -edge.direction_v;
    edges.add(name, map);
  }
  return {{"field", shipped::item(field())},
          {"views", shipped::list(views, "view")},
          {"edges", shipped::list(edges, "view")}};
}

/// Holds the inputs that the cost refers to.
struct Made {
  shipped::Inputs in;
  marrow::Value value;
  explicit Made(shipped::Inputs from, const shipped::Options& options = {})
      : in(std::move(from)), value(shipped::call("similarity.ray_to_surface", in, options).at("cost")) {}
  const Cost& operator*() const { return value.as<Cost>(); }
};

RigidTransform shifted(double x, double y, double z) { return shapes::centred_at({-x, -y, -z}); }

double tukey(double d, double reach) {
  return d < reach ? reach * reach / 6 * (1 - std::pow(1 - d * d / (reach * reach), 3)) : reach * reach / 6;
}

TEST(RayToSurface, IsTheDistanceThatOneComputesByHand) {
  const Made cost(inputs(), {{"ray_step", std::int64_t(1)}, {"reach_mm", 5.0}});
  EXPECT_NEAR((*cost).value(shifted(0, 0, 0)), 0, 2e-3) << "touches all rays, up to the voxels";
  // A shift s along the axis of the frontal view hardly changes this view. The lateral view sees it from the side: a
  // ray at an angle a to the shift passes the surface at a distance of s cos a.
  const double s = 1.5;
  double lateral = 0, frontal = 0;
  for (int i = 0; i < 360; ++i) {
    lateral += tukey(s * std::abs(std::cos(marrow::radians(i))), 5) / 360;
    frontal += tukey(kRadius_mm * s / 600, 5) / 360;
  }
  EXPECT_NEAR((*cost).value(shifted(0, s, 0)), 0.5 * (lateral + frontal), 0.02);
}

TEST(RayToSurface, WhatIsFarOrOfTheOtherDirectionIsTheWorst) {
  const double worst = 16.0 / 6;
  const Made cost(inputs());
  EXPECT_NEAR((*cost).value(shifted(200, 0, 0)), worst, 1e-12);
  EXPECT_NEAR((*cost).value(shifted(0, -2000, 0)), worst, 1e-12) << "behind a source";
  EXPECT_NEAR((*Made(inputs(true))).value(shifted(0, 0, 0)), worst, 0.06)
      << "but for a few rays that touch the smaller ball from the other side";
}

/// The field ends 1 mm before the larger ball does. The column of voxels at its other end has this distance.
shipped::Inputs ends_in_the_ball(float first_column_mm) {
  marrow::SignedField cut = field();
  const marrow::SignedField whole = cut;
  cut.grid.size[0] = 43;
  cut.values_mm.clear();
  for (int z = 0; z < cut.grid.size[2]; ++z)
    for (int y = 0; y < cut.grid.size[1]; ++y)
      for (int x = 0; x < cut.grid.size[0]; ++x) cut.values_mm.push_back(x == 0 ? first_column_mm : whole.at(x, y, z));
  shipped::Inputs in = inputs();
  in.at("field") = shipped::item(cut);
  return in;
}

TEST(RayToSurface, NothingIsReadBeyondTheField) {
  // Voxels are stored row after row: the first voxel of a row follows the last one of the row before.
  EXPECT_NEAR((*Made(ends_in_the_ball(5.9f))).value(shifted(0, 0, 0)),
              (*Made(ends_in_the_ball(4.1f))).value(shifted(0, 0, 0)), 1e-6);
}

TEST(RayToSurface, KnowsItsDerivatives) {
  const Made cost(inputs());
  RigidTransform pose = shifted(0.8, -0.6, 0.7);
  pose.rotation = marrow::rotation_from_vector({0.02, 0.03, -0.02});
  const marrow::FragmentFrame frame{Eigen::Vector3d(1, 2, 3), marrow::rotation_from_vector({0.3, 0.2, -0.1})};
  const auto about = (*cost).expansion(pose, frame);
  ASSERT_TRUE(about.has_value());
  EXPECT_NEAR(about->value, (*cost).value(pose), 1e-12);
  for (int k = 0; k < 6; ++k) {
    const double h = k < 3 ? 5e-3 : 0.1;
    const auto at = [&](double by) {
      return (*cost).value(marrow::moved(pose, frame, by * marrow::Vector6d::Unit(k)));
    };
    EXPECT_NEAR(about->gradient[k], (at(h) - at(-h)) / (2 * h), k < 3 ? 0.08 : 0.02) << k;
  }
  EXPECT_GE(about->curvature.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-12);
  // Near the minimum the curvature is that of the cost.
  const auto bottom = (*cost).expansion(shifted(0, 0, 0), {});
  const double h = 0.3;
  for (int k = 3; k < 6; ++k) {
    const auto at = [&](double by) {
      return (*cost).value(marrow::moved(shifted(0, 0, 0), {}, by * marrow::Vector6d::Unit(k)));
    };
    EXPECT_NEAR(bottom->curvature(k, k), (at(h) - 2 * at(0) + at(-h)) / (h * h), 0.1 * bottom->curvature(k, k)) << k;
  }
}

TEST(RayToSurface, DerivativesDoNotDependOnTheSizesOfVoxels) {
  shipped::Inputs longer = inputs();
  longer.at("field") = shipped::item(field({0.8, 1, 1.25}));
  const Made cost(inputs()), other(longer);
  const RigidTransform pose = shifted(0.8, -0.6, 0.7);
  const auto expected = (*cost).expansion(pose, {}), found = (*other).expansion(pose, {});
  EXPECT_LT((found->gradient - expected->gradient).tail<3>().norm(), 0.02 * expected->gradient.tail<3>().norm());
}

TEST(RayToSurface, LevelsUseFewerRays) {
  const Made cost(inputs());
  const auto coarse = (*cost).at_level({6, 30, 0});
  EXPECT_LT(coarse->value(shifted(0, 0, 0)), 0.01);
  EXPECT_NEAR(coarse->value(shifted(300, 0, 0)), 6.0 * 6 / 6, 1e-9)
      << "30 px are 10.5 mm at the isocentre, but the field ends at 6 mm";
}

TEST(RayToSurface, AnotherFragmentsEdgesDoNotCount) {
  shipped::Inputs alone = inputs(), both = inputs();
  const other_fragment::Fragments<marrow::OutlineProjector> fragments{
      std::make_shared<const other_fragment::SquareOutline>(), std::make_shared<const other_fragment::SquareOutline>()};
  const auto edges = both["edges"].as_list<marrow::EdgeMap>();
  marrow::List<marrow::EdgeMap> more;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    marrow::EdgeMap map = edges[i];
    for (int v = 60; v < 90; ++v) map.pixels.push_back({101, float(v), -1, 0, 100});
    more.add(edges.name(i), map);
  }
  both["edges"] = shipped::list(more, "view");
  const RigidTransform pose = shifted(0.8, -0.6, 0.7);
  const shipped::Options all{{"ray_step", std::int64_t(1)}};
  const double without = (*Made(alone, all)).value(pose);
  EXPECT_GT((*Made(both, all)).value(pose), without + 0.1);
  const shipped::Inputs told = fragments.with(both);
  EXPECT_EQ((*Made(told, all)).value(pose), without);
  shipped::Inputs unknown = told;
  unknown.erase("projector");
  EXPECT_EQ(shipped::refusal("similarity.ray_to_surface", unknown),
            "there are other fragments, but it is not known which of them is this one; wire 'projector', the one that "
            "draws this fragment");
}

TEST(RayToSurface, SaysWhatIsWrong) {
  shipped::Inputs broken = inputs();
  broken["edges"] = {};
  EXPECT_EQ(shipped::refusal("similarity.ray_to_surface", broken),
            "there are 2 views, but edge maps of 0; give the edges of each view");
  broken = inputs();
  marrow::SignedField outside = field();
  outside.values_mm.assign(outside.values_mm.size(), 6);
  broken["field"] = shipped::item(outside);
  EXPECT_EQ(shipped::refusal("similarity.ray_to_surface", broken),
            "the field has no inside, so no ray can touch its surface; check the segmentation");
}

TEST(RayToSurface, SaysWhatIsEmpty) {
  const Made cost(inputs());
  EXPECT_EQ((*cost).nothing_compared(shifted(1, 0, 0)), "");
  EXPECT_EQ((*cost).nothing_compared(shifted(200, 0, 0)),
            "view 'frontal': no ray through an edge passes within 4 mm of the model's surface; "
            "view 'lateral': no ray through an edge passes within 4 mm of the model's surface");
  shipped::Inputs masked = inputs();
  marrow::List<marrow::View> views;
  for (marrow::View view : masked["views"].as_list<marrow::View>()) {
    view.mask = cv::Mat(view.camera.height_px, view.camera.width_px, CV_8U, cv::Scalar(view.name == "lateral" ? 0 : 1));
    views.add(view.name, view);
  }
  masked["views"] = shipped::list(views, "view");
  EXPECT_EQ(
      (*Made(masked)).silent_views(shifted(1, 0, 0)),
      std::vector<std::string>{"view 'lateral': it has no edge that is inside the mask and belongs to this bone"});
}

TEST(RayToSurface, APoseThatIsNotANumberIsTheWorst) {
  const Made cost(inputs());
  for (const double wrong : {std::nan(""), HUGE_VAL}) {
    EXPECT_NEAR((*cost).value(shifted(wrong, 0, 0)), 16.0 / 6, 1e-12);
    RigidTransform turned = shifted(0, 0, 0);
    turned.rotation.setConstant(wrong);
    EXPECT_NEAR((*cost).value(turned), 16.0 / 6, 1e-12);
  }
}

}  // namespace ray_to_surface_test
