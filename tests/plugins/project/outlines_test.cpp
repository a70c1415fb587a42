// SPDX-License-Identifier: Apache-2.0
// What every projector of outlines must satisfy, with its own tolerance in pixels.

#include "tests/plugins/project/shapes.hpp"

namespace marrow::test::outlines_test {

struct Node {
  const char* name;
  double tolerance_px, model_tolerance_px;
};
void PrintTo(const Node& node, std::ostream* stream) { *stream << node.name; }

class Outlines : public testing::TestWithParam<Node> {
 protected:
  static std::shared_ptr<const OutlineProjector> make(const Mesh& mesh, const Volume* volume) {
    Inputs inputs{{"model", item(mesh)}};
    if (volume) inputs["volume"] = item(*volume);
    return made<OutlineProjector>(std::string("project.") + GetParam().name, "projector", inputs);
  }
};
INSTANTIATE_TEST_SUITE_P(, Outlines, testing::Values(Node{"silhouette", 0.8, 4}, Node{"silhouette_edges", 0.02, 0.01}),
                         [](const auto& info) { return info.param.name; });

/// The outline of a sphere is the circle (ellipse) where the cone of tangent rays meets the detector. The half angle of
/// the cone is asin(r / d).
TEST_P(Outlines, SphereIsItsTangentCone) {
  const auto [name, tolerance_px, model_tolerance_px] = GetParam();
  const Mesh mesh = shapes::sphere(30);
  const auto projector = make(mesh, nullptr);
  const Camera camera = shapes::c_arm(0);
  const Vector3d centre(12, -20, 9);
  RigidTransform world_from_model = shapes::centred_at({0, 0, 30});
  world_from_model.translation_mm += centre;
  const auto points = projector->outline(camera, world_from_model, 2);
  ASSERT_GT(points.size(), 100u);
  const Vector3d source = source_position_mm(camera), sight = centre - source;
  const double half_angle = std::asin(30 / sight.norm());
  for (const auto& p : points) {
    const Vector3d ray = ray_direction(camera, {p.u_px, p.v_px});
    const double angle = std::acos(ray.dot(sight.normalized()));
    const double focal_px = camera.intrinsics(0, 0);
    EXPECT_NEAR((angle - half_angle) * focal_px, 0, tolerance_px);
    const Vector2d outward = Vector2d(p.u_px, p.v_px) - project(camera, centre);
    EXPECT_GT(outward.normalized().dot(Vector2d(p.normal_u, p.normal_v)), 0.95);
    EXPECT_NEAR(std::hypot(p.normal_u, p.normal_v), 1, 1e-5);
    EXPECT_LT((project(camera, world_from_model * p.model_mm.cast<double>()) - Vector2d(p.u_px, p.v_px)).norm(),
              model_tolerance_px);
  }
  const double circumference_px = 2 * kPi * camera.intrinsics(0, 0) * std::tan(half_angle);
  EXPECT_GT(double(points.size()), 0.65 * circumference_px / 2);
  EXPECT_LT(double(points.size()), 1.15 * circumference_px / 2);
}

/// Of two spheres, one behind the other, only the outer outline counts. Side by side, both count.
TEST_P(Outlines, HiddenPartsAreLeftOut) {
  Mesh mesh = shapes::sphere(30);
  const Mesh second = shapes::sphere(15);
  const auto offset = std::uint32_t(mesh.vertices_mm.size());
  for (const auto& v : second.vertices_mm) mesh.vertices_mm.push_back(v + Vector3d(0, 60, 15));
  for (const auto& t : second.triangles) mesh.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
  const auto projector = make(mesh, nullptr);
  const auto pose = shapes::centred_at({0, 30, 30});
  const auto count_small = [&](double angle_deg) {
    std::size_t count = 0;
    for (const auto& p : projector->outline(shapes::c_arm(angle_deg), pose, 2)) count += p.model_mm.y() > 40;
    return count;
  };
  EXPECT_EQ(count_small(0), 0u);
  EXPECT_GT(count_small(90), 40u);
}

/// A cylinder that runs through both ends of its CT. Its sides count, its two ends do not.
TEST_P(Outlines, EndsOfTheVolumeAreLeftOut) {
  const Mesh mesh = shapes::cylinder(14, 100);
  Volume volume;
  volume.grid.size = {61, 61, 101};
  volume.grid.origin_mm = {-30, -30, 0};
  const auto pose = shapes::centred_at({0, 0, 50});
  const Camera camera = shapes::c_arm(0);
  std::size_t all = 0, level = 0;
  for (const auto& p : make(mesh, &volume)->outline(camera, pose, 1)) {
    ++all;
    level += std::abs(p.normal_v) > 0.5;
    EXPECT_GT(p.model_mm.z(), 1);
    EXPECT_LT(p.model_mm.z(), 99);
  }
  EXPECT_GT(all, 400u);
  EXPECT_EQ(level, 0u);
  level = 0;
  for (const auto& p : make(mesh, nullptr)->outline(camera, pose, 1)) level += std::abs(p.normal_v) > 0.9;
  EXPECT_GT(level, 60u);

  const auto refusal = [&] { return MESSAGE_OF(make(mesh, &volume)); };
  volume.grid.origin_mm.x() += 500;
  EXPECT_EQ(refusal(), "only 0 % of the mesh lies in the volume; give those that belong together");
  volume.grid.frame = "mr";
  EXPECT_EQ(refusal(), "the mesh is in frame 'ct', but the volume in frame 'mr'; give those that belong together");
}

TEST_P(Outlines, KeepsInsideTheImage) {
  const Mesh mesh = shapes::cylinder(14, 400);
  const auto projector = make(mesh, nullptr);
  const auto points = projector->outline(shapes::c_arm(0), shapes::centred_at({0, 0, 200}), 1);
  EXPECT_GT(points.size(), 900u);
  for (const auto& p : points) {
    EXPECT_TRUE(p.u_px >= 0 && p.u_px <= 511 && p.v_px >= 0 && p.v_px <= 511);
    EXPECT_GT(std::abs(p.normal_u), 0.9) << "the image's border is no outline";
  }
  EXPECT_TRUE(projector->outline(shapes::c_arm(0), shapes::centred_at({500, 0, 0}), 1).empty());
  EXPECT_TRUE(projector->outline(shapes::c_arm(0), shapes::centred_at({0, 2000, 0}), 1).empty()) << "behind the source";
}

TEST_P(Outlines, RefusesNonsense) {
  EXPECT_EQ(MESSAGE_OF(make(Mesh{}, nullptr)), "the mesh to project: the surface has no triangles");
  const Mesh mesh = shapes::sphere(10);
  EXPECT_THROW(make(mesh, nullptr)->outline(shapes::c_arm(0), shapes::centred_at({0, 0, 10}), 0), Error);
}

std::shared_ptr<const OutlineProjector> exact_outline(const Mesh& mesh) {
  return made<OutlineProjector>("project.silhouette_edges", "projector", {{"model", item(mesh)}});
}

TEST(SilhouetteEdges, OpenSurfaceGivesItsSidesOnly) {
  Mesh mesh = shapes::cylinder(14, 100);
  mesh.triangles.resize(mesh.triangles.size() - 400);  // both lids gone
  const auto points = exact_outline(mesh)->outline(shapes::c_arm(0), shapes::centred_at({0, 0, 50}), 1);
  EXPECT_GT(points.size(), 400u);
  for (const auto& p : points) EXPECT_GT(std::abs(p.normal_u), 0.9);
}

TEST(SilhouetteEdges, RepeatedVerticesAreWelded) {
  const Mesh mesh = shapes::sphere(30);
  Mesh soup;
  for (const auto& t : mesh.triangles) {
    const auto first = std::uint32_t(soup.vertices_mm.size());
    for (const auto corner : t) soup.vertices_mm.push_back(mesh.vertices_mm[corner]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  const auto pose = shapes::centred_at({0, 0, 30});
  const auto a = exact_outline(mesh)->outline(shapes::c_arm(0), pose, 4);
  const auto b = exact_outline(soup)->outline(shapes::c_arm(0), pose, 4);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i].u_px, b[i].u_px, 1e-3);
}

TEST(SilhouetteEdges, AgreesWithItselfOnAGridTwiceAsCoarse) {
  const Mesh mesh = shapes::distal_femur();
  const auto pose = shapes::centred_at({0, 0, 90});
  const auto projector = exact_outline(mesh);
  const auto fine = projector->outline(shapes::c_arm(90), pose, 1),
             coarse = projector->outline(shapes::c_arm(90), pose, 2);
  EXPECT_NEAR(double(fine.size()), 2.0 * double(coarse.size()), 0.03 * double(fine.size()));
}

}  // namespace marrow::test::outlines_test
