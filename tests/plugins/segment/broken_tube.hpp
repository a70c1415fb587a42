// SPDX-License-Identifier: Apache-2.0
#pragma once
// A hollow bone in two fragments, cut obliquely and possibly displaced, for tests of every segmenter.
#include "tests/plugins/segment/phantom.hpp"

namespace marrow::test::bones {

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

}  // namespace marrow::test::bones
