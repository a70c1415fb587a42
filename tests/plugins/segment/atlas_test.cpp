// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/segment/broken_tube.hpp"
#include "tests/plugins/segment/segmented.hpp"

namespace marrow::test::atlas_test {

/// A bone with ends that are not round, so that it lies one way only, in two fragments of a known displacement.
struct Bone {
  double gap_mm = 0, turned_deg = 0, aside_mm = 0;

  static double whole(const Vector3d& p) {
    const double shaft = bones::round_cone(p, {0, 0, -25}, {0, 0, 25}, 8, 7),
                 head = bones::round_cone(p, {0, 0, 25}, {8, 0, 30}, 9, 7);
    const double foot = bones::round_cone(p, {-5, -4, -25}, {6, 2, -27}, 9, 9);
    return std::min({shaft, head, foot});
  }
  Vector3d in_distal(const Vector3d& p) const {
    return Eigen::AngleAxisd(-turned_deg * M_PI / 180, Vector3d::UnitX()) * (p - Vector3d(0, aside_mm, 0));
  }
  Vector3d out_of_distal(const Vector3d& p) const {
    return Eigen::AngleAxisd(turned_deg * M_PI / 180, Vector3d::UnitX()) * p + Vector3d(0, aside_mm, 0);
  }
  double distance(const Vector3d& p, std::size_t fragment) const {
    if (fragment == 0) return std::max(whole(p), 0.5 * gap_mm - p.z());
    const Vector3d q = in_distal(p);
    return std::max(whole(q), q.z() + 0.5 * gap_mm);
  }
  Volume volume() const {
    return bones::scan(
        bones::ct_grid({52, 60, 96}),
        [&](const Vector3d& p) {
          return 50 + 900 * std::min(1.0, bones::filled(distance(p, 0)) + bones::filled(distance(p, 1)));
        },
        0.5, 30, 9);
  }
  List<Seeds> seeds() const {
    List<Seeds> seeds;
    seeds.add("proximal", Seeds{"proximal", {{0, 0, 10}, {0, 0, 25}}});
    seeds.add("distal", Seeds{"distal", {out_of_distal({0, 0, -10}), out_of_distal({0, 0, -25})}});
    return seeds;
  }
};

/// The whole bone's surface: each point of a sphere moved along its ray from the middle line.
Mesh template_mesh(double scale, const Vector3d& shift) {
  Mesh mesh;
  const int rings = 60, around = 48;
  const auto surface = [&](double t, double angle) -> Vector3d {
    const Vector3d middle(0, 0, -25 + 50 * std::clamp(t, 0.0, 1.0));
    const double tilt = t < 0 ? t : t > 1 ? t - 1 : 0;  // beyond the ends the rays turn to the poles
    const Vector3d ray =
        Vector3d(std::cos(angle) * std::cos(tilt), std::sin(angle) * std::cos(tilt), std::sin(tilt)).normalized();
    double low = 0, high = 40;
    for (int i = 0; i < 40; ++i) (Bone::whole(middle + 0.5 * (low + high) * ray) < 0 ? low : high) = 0.5 * (low + high);
    return scale * (middle + low * ray) + shift;
  };
  for (int i = 1; i < rings; ++i)
    for (int j = 0; j < around; ++j)
      mesh.vertices_mm.push_back(surface(-M_PI / 2 + (1 + M_PI) * i / rings, 2 * M_PI * j / around));
  const auto at = [&](int i, int j) { return std::uint32_t((i - 1) * around + j % around); };
  for (int i = 1; i + 1 < rings; ++i)
    for (int j = 0; j < around; ++j) {
      mesh.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j)});
      mesh.triangles.push_back({at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)});
    }
  for (const bool top : {false, true}) {
    const auto pole = std::uint32_t(mesh.vertices_mm.size());
    mesh.vertices_mm.push_back(surface(top ? 1 + M_PI / 2 : -M_PI / 2, 0));
    for (int j = 0; j < around; ++j) {
      const int ring = top ? rings - 1 : 1;
      if (top)
        mesh.triangles.push_back({at(ring, j), at(ring, j + 1), pole});
      else
        mesh.triangles.push_back({at(ring, j + 1), at(ring, j), pole});
    }
  }
  return mesh;
}

Inputs inputs(const Bone& bone, const Mesh& whole) {
  Inputs inputs = segmented::inputs(bone.volume(), bone.seeds());
  inputs["template"] = item(whole);
  return inputs;
}

std::array<bones::Accuracy, 2> accuracy_of(const Bone& bone) {
  const auto fields =
      output_list<SignedField>("segment.atlas", "field", inputs(bone, template_mesh(1.15, {30, -20, 12})));
  EXPECT_EQ(fields.size(), 2u);
  EXPECT_EQ(bones::overlap(fields), 0u);
  std::array<bones::Accuracy, 2> accuracies;
  for (std::size_t f = 0; f < 2; ++f) {
    accuracies[f] = bones::compare(
        fields[f], [&](const Vector3d& p) { return bone.distance(p, f); },
        [&](const Vector3d& p) { return std::abs(p.z()) > 6; });
  }
  return accuracies;
}

TEST(Atlas, FindsTheSameBoneOfAnotherSizeElsewhere) {
  for (const auto& accuracy : accuracy_of({})) {
    EXPECT_GT(accuracy.dice, 0.95);
    EXPECT_LT(accuracy.mean_mm, 0.6);
  }
}

// The chapter: segmentation by an atlas fails on fractures. The level set, on the same CT, does not.
TEST(Atlas, FailsOnADisplacedFracture) {
  const Bone broken{.gap_mm = 3, .turned_deg = 18, .aside_mm = 9};
  const auto accuracies = accuracy_of(broken);
  EXPECT_LT(std::min(accuracies[0].dice, accuracies[1].dice), 0.9);
  EXPECT_GT(std::max(accuracies[0].mean_mm, accuracies[1].mean_mm), 1.0);
}

TEST(Atlas, WantsAClosedTemplate) {
  Mesh open = template_mesh(1, Vector3d::Zero());
  open.triangles.pop_back();
  EXPECT_EQ(refusal("segment.atlas", inputs({}, open)),
            "template: a closed surface expected, got one with holes; its inside is not defined");
}

}  // namespace marrow::test::atlas_test
