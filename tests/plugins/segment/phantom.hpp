// SPDX-License-Identifier: Apache-2.0
#pragma once
// Analytic hollow bones, the CT that a scanner would make of them, and how far a field's surface lies from the truth.
#include <tbb/parallel_for.h>

#include "tests/harness/node_test.hpp"

namespace marrow::test::bones {

using Distance = std::function<double(const Vector3d&)>;

/// Signed distance to a cone with spherical ends (exact).
inline double round_cone(const Vector3d& p, const Vector3d& a, const Vector3d& b, double radius_a, double radius_b) {
  const Vector3d axis = b - a;
  const double length = axis.norm(), along = (p - a).dot(axis) / length;
  const double across = (p - a - axis / length * along).norm();
  const double sine = (radius_a - radius_b) / length, cosine = std::sqrt(1 - sine * sine);
  const double k = along * cosine - across * sine;  // foot on the cone's side, measured along it
  if (k < 0) return std::hypot(along, across) - radius_a;
  if (k > length * cosine) return std::hypot(along - length, across) - radius_b;
  return across * cosine + along * sine - radius_a;
}

/// HU at a point of the continuous scene.
using Scene = std::function<double(const Vector3d&)>;

/// Volume of a body with a soft rim as wide as the sub-voxels, which stands for their partial filling.
inline double filled(double distance_mm) { return std::clamp(0.5 - distance_mm / 0.4, 0.0, 1.0); }

inline void blur_axis(std::vector<float>& values, const std::array<int, 3>& size, int axis, double sigma) {
  std::vector<float> kernel;
  const int reach = int(std::ceil(4 * sigma));
  float sum = 0;
  for (int k = -reach; k <= reach; ++k)
    kernel.push_back(float(std::exp(-0.5 * k * k / sigma / sigma))), sum += kernel.back();
  const std::array<std::size_t, 3> steps{1, std::size_t(size[0]), std::size_t(size[0]) * size[1]};
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  tbb::parallel_for(0, size[v], [&](int j) {
    std::vector<float> line(static_cast<std::size_t>(size[axis]));
    for (int i = 0; i < size[u]; ++i) {
      float* at = values.data() + i * steps[u] + j * steps[v];
      for (int n = 0; n < size[axis]; ++n) line[std::size_t(n)] = at[n * steps[axis]];
      for (int n = 0; n < size[axis]; ++n) {
        float total = 0;
        for (int k = -reach; k <= reach; ++k)
          total += kernel[std::size_t(k + reach)] * line[std::size_t(std::clamp(n + k, 0, size[axis] - 1))];
        at[n * steps[axis]] = total / sum;
      }
    }
  });
}

/// The CT of a scene: 2 x 2 x 2 sub-voxels, a Gaussian point-spread function, the mean over each voxel, Gaussian noise.
inline Volume scan(const Grid& grid, const Scene& scene, double psf_mm, double noise_hu, unsigned seed) {
  const std::array<int, 3> fine{grid.size[0] * 2, grid.size[1] * 2, grid.size[2] * 2};
  std::vector<float> values(std::size_t(fine[0]) * fine[1] * fine[2]);
  const auto at = [&](int x, int y, int z) { return (std::size_t(z) * fine[1] + y) * fine[0] + x; };
  tbb::parallel_for(0, fine[2], [&](int z) {
    for (int y = 0; y < fine[1]; ++y)
      for (int x = 0; x < fine[0]; ++x)
        values[at(x, y, z)] = float(scene(grid.point_from_index(Vector3d(x, y, z) / 2 - Vector3d::Constant(0.25))));
  });
  for (int axis = 0; axis < 3; ++axis) blur_axis(values, fine, axis, psf_mm / grid.spacing_mm[axis] * 2);
  Volume volume{grid, std::vector<float>(grid.count())};
  std::mt19937 random(seed);
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        double sum = 0, noise = 0;
        for (int k = 0; k < 8; ++k) sum += values[at(2 * x + (k & 1), 2 * y + (k >> 1 & 1), 2 * z + (k >> 2))];
        for (int k = 0; k < 12; ++k) noise += double(random()) / double(std::mt19937::max()) - 0.5;  // variance 1
        volume.values[grid.offset(x, y, z)] = float(std::round(sum / 8 + noise_hu * noise));
      }
  return volume;
}

struct Accuracy {
  double dice = 0, bias_mm = 0, mean_mm = 0, rms_mm = 0, largest_mm = 0;
  std::size_t points = 0;
};

/// A field is as good as this.
inline void expect_within(const Accuracy& found, double least_dice, double most_bias_mm, double most_mean_mm) {
  EXPECT_GT(found.dice, least_dice);
  EXPECT_LT(std::abs(found.bias_mm), most_bias_mm);
  EXPECT_LT(found.mean_mm, most_mean_mm);
}

/// Compares a field with the true signed distance: Dice over voxels, and the true distance of each point where the
/// field's zero level crosses a grid edge, as far as `counts` says that the point counts.
inline Accuracy compare(
    const SignedField& field, const Distance& truth_mm,
    const std::function<bool(const Vector3d&)>& counts = [](const Vector3d&) { return true; }) {
  const Grid& grid = field.grid;
  Accuracy accuracy;
  double both = 0, either = 0;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const double here = field.at(x, y, z);
        const bool inside = here < 0, truly = truth_mm(grid.point_from_index(Vector3d(x, y, z))) < 0;
        both += inside && truly;
        either += double(inside) + double(truly);
        for (int k = 0; k < 3; ++k) {
          const int i = x + (k == 0), j = y + (k == 1), l = z + (k == 2);
          if (!grid.contains(i, j, l) || (field.at(i, j, l) < 0) == inside) continue;
          Vector3d index(x, y, z);
          index[k] += here / (here - field.at(i, j, l));
          const Vector3d point = grid.point_from_index(index);
          if (!counts(point)) continue;
          const double error = truth_mm(point);
          accuracy.bias_mm += error;
          accuracy.mean_mm += std::abs(error);
          accuracy.rms_mm += error * error;
          accuracy.largest_mm = std::max(accuracy.largest_mm, std::abs(error));
          ++accuracy.points;
        }
      }
  accuracy.dice = 2 * both / either;
  accuracy.bias_mm /= double(accuracy.points);
  accuracy.mean_mm /= double(accuracy.points);
  accuracy.rms_mm = std::sqrt(accuracy.rms_mm / double(accuracy.points));
  return accuracy;
}

/// A grid with the CT's spacing, centred on the origin.
inline Grid ct_grid(const std::array<int, 3>& size) {
  const Vector3d spacing_mm(0.8, 0.8, 1.0);
  return grid_at(size, -Vector3d(size[0] - 1, size[1] - 1, size[2] - 1).cwiseProduct(spacing_mm) / 2, spacing_mm);
}

/// A hollow bone in two fragments, cut obliquely and possibly displaced.
struct BrokenTube {
  double gap_mm = 1;
  /// Of the distal fragment, turned about the x axis at the cut and pushed aside, as fractures are.
  double turned_deg = 0, aside_mm = 0;
  Vector3d normal = Vector3d(0.35, 0.1, 1).normalized();

  static double outer(const Vector3d& p) { return round_cone(p, {0, 0, -90}, {0, 0, 90}, 11, 13); }
  static double inner(const Vector3d& p) { return round_cone(p, {0, 0, -90}, {0, 0, 90}, 6, 8); }
  Vector3d in_distal(const Vector3d& p) const {
    return Eigen::AngleAxisd(-turned_deg * M_PI / 180, Vector3d::UnitX()) * (p - Vector3d(0, aside_mm, 0));
  }
  double distance(const Vector3d& p, std::size_t fragment) const {
    if (fragment == 0) return std::max(outer(p), 0.5 * gap_mm - normal.dot(p));
    const Vector3d q = in_distal(p);
    return std::max(outer(q), normal.dot(q) + 0.5 * gap_mm);
  }
  double hu(const Vector3d& p) const {
    const double proximal = filled(distance(p, 0)), distal = filled(distance(p, 1));
    const double canal = proximal * filled(inner(p)) + distal * filled(inner(in_distal(p)));
    return 50 + 1250 * std::min(1.0, proximal + distal) - 1320 * std::min(1.0, canal);
  }
  Volume volume() const {
    return scan(
        ct_grid({44, 44, 72}), [this](const Vector3d& p) { return hu(p); }, 0.5, 30, 3);
  }
  List<Seeds> seeds(bool both_wanted = true) const {
    List<Seeds> seeds;
    const Eigen::AngleAxisd turn(turned_deg * M_PI / 180, Vector3d::UnitX());
    const Vector3d aside(0, aside_mm, 0);
    seeds.add("proximal", Seeds{"proximal", {{9.7, 0, 18}, {-9.7, 0, 18}}, both_wanted});
    seeds.add("distal", Seeds{"distal", {turn * Vector3d(9.3, 0, -18) + aside, turn * Vector3d(-9.3, 0, -18) + aside}});
    return seeds;
  }
  /// Dice of a fragment, and its wall's distance from the truth, away from the cut and from the volume's ends.
  Accuracy compare(const List<SignedField>& fields, std::size_t fragment) const {
    return bones::compare(
        fields[fragment], [&](const Vector3d& p) { return distance(p, fragment); },
        [&](const Vector3d& p) { return std::abs(normal.dot(p)) > 4 && std::abs(p.z()) < 33; });
  }
};

inline std::size_t overlap(const List<SignedField>& fields) {
  std::size_t both = 0;
  for (std::size_t at = 0; at < fields[0].values_mm.size(); ++at)
    both += fields[0].values_mm[at] < 0 && fields[1].values_mm[at] < 0;
  return both;
}

/// Both fragments are there, apart from each other and as large as they are.
inline void expect_both(const BrokenTube& tube, const List<SignedField>& fields) {
  ASSERT_EQ(fields.size(), 2u);
  EXPECT_EQ(overlap(fields), 0u);
  for (std::size_t f = 0; f < 2; ++f) {
    const Accuracy accuracy = tube.compare(fields, f);
    EXPECT_GT(accuracy.dice, 0.97) << fields.name(f);
    EXPECT_LT(std::abs(accuracy.bias_mm), 0.1) << fields.name(f);
  }
}

/// The distal end of a femur, broken through its spongy bone with a gap of 1 mm: a scene that no single threshold
/// segments. The shaft's cortex is thick and bright; towards the joint it thins out to less than a voxel over spongy
/// bone of 280 HU, and the fracture's faces have no cortex at all.
struct DistalEnd {
  double gap_mm = 1, spongy_hu = 280, tissue_hu = 50, marrow_hu = -40;
  Vector3d cut_normal = Vector3d(0.35, 0.15, 1).normalized(), cut_point{0, 0, -25};

  /// Below zero in the bone, near its surface a distance: shaft, its flare and two condyles, blended over 6 mm.
  double outline(const Vector3d& p) const {
    const double shaft = round_cone(p, {0, 0, -20}, {2, 3, 140}, 17, 14),
                 flare = round_cone(p, {0, 0, -62}, {0, 0, -10}, 25, 17.5);
    const double medial = round_cone(p, {-20, -4, -66}, {-20, 10, -66}, 20, 19),
                 lateral = round_cone(p, {20, -6, -65}, {20, 8, -64}, 19, 19);
    return blend(blend(shaft, flare), blend(medial, lateral));
  }
  double over_cut_mm(const Vector3d& p) const { return cut_normal.dot(p - cut_point); }
  /// Signed distance to the surface of the proximal (side 1) or the distal fragment (-1).
  double distance(const Vector3d& p, int side) const {
    return std::max(outer_distance(p), 0.5 * gap_mm - side * over_cut_mm(p));
  }
  double outer_distance(const Vector3d& p) const {
    const double value = outline(p);
    if (std::abs(value) > 3) return value;
    Vector3d slope;
    for (int k = 0; k < 3; ++k) {
      const Vector3d step = 0.05 * Vector3d::Unit(k);
      slope[k] = (outline(p + step) - outline(p - step)) / 0.1;
    }
    return value / std::max(slope.norm(), 0.3);
  }

  static double fade(double z, double low, double high) { return std::clamp((z - low) / (high - low), 0.0, 1.0); }
  double hu(const Vector3d& p) const {
    const double surface = outline(p), cortex_mm = 0.6 + 4.4 * fade(p.z(), -50, 40),
                 cortex_hu = 1000 + 300 * fade(p.z(), -50, 0);
    const double inside_hu = spongy_hu + (marrow_hu - spongy_hu) * fade(p.z(), 0, 35);
    const double bone = filled(std::max(surface, 0.5 * gap_mm - std::abs(over_cut_mm(p)))),
                 core = filled(surface + cortex_mm);
    return tissue_hu + bone * (cortex_hu + core * (inside_hu - cortex_hu) - tissue_hu);
  }
  Volume scan_of(std::array<int, 3> size, double noise_hu) const {
    return scan(
        ct_grid(size), [this](const Vector3d& p) { return hu(p); }, 0.5, noise_hu, 5);
  }
  /// The fields of the proximal and of the distal fragment, away from the volume's end.
  Accuracy compare(const List<SignedField>& fields, std::size_t fragment) const {
    return bones::compare(
        fields[fragment], [&](const Vector3d& p) { return distance(p, fragment == 0 ? 1 : -1); },
        [](const Vector3d& p) { return p.z() < 90; });
  }
  List<Seeds> seeds() const {
    return named("proximal", Seeds{"proximal", {{0, 0, -10}, {13, 1, 50}, {-12, 2, 50}}}, "distal",
                 Seeds{"distal", {{-20, 0, -66}, {20, 0, -64}, {0, 0, -45}}});
  }

 private:
  static double blend(double a, double b) {
    const double overlap = std::max(6 - std::abs(a - b), 0.0) / 6;
    return std::min(a, b) - overlap * overlap * 6 / 4;
  }
};

}  // namespace marrow::test::bones

namespace phantom = marrow::test::bones;

namespace marrow::test::segmented {

inline Inputs inputs(const Volume& volume, const List<Seeds>& seeds) {
  return {{"volume", item(volume)}, {"seeds", shipped::list(seeds, "fragment")}};
}

/// The fields that a node gives.
inline List<SignedField> fields(const std::string& node, const Volume& volume, const List<Seeds>& seeds,
                                const Options& options = {}) {
  return output_list<SignedField>(node, "field", inputs(volume, seeds), options);
}

}  // namespace marrow::test::segmented
