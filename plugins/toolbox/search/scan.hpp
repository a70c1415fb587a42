// SPDX-License-Identifier: Apache-2.0
#pragma once
// The poses that a search evaluates first.
#include <array>
#include <cmath>

#include "marrow/toolbox/search/search.hpp"

namespace marrow::search {

constexpr int kAxialRotation = 2, kAxialTranslation = 5;

/// Motions of the start that are tried first, in degrees and mm, and the reach within which two of them are neighbours.
struct Scan {
  std::vector<Vector6d> motions;
  Vector6d reach;  ///< half the sides of a box for a grid, else the half-axes of an ellipsoid
  bool grid = true;

  bool near(int a, int b) const {
    const Vector6d way = (motions[std::size_t(a)] - motions[std::size_t(b)]).cwiseQuotient(reach);
    return (grid ? way.cwiseAbs().maxCoeff() : way.norm()) <= 1;
  }
};

/// A grid of axial rotations and translations, because the first stage does not determine them.
inline Scan axial_scan(const SearchOptions& options) {
  const auto steps = [](double range, double step) { return int(std::floor(range / step + 1e-9)); };
  const int turns = steps(options.scan_rotation_deg, options.scan_rotation_step_deg);
  const int shifts = steps(options.scan_translation_mm, options.scan_translation_step_mm);
  Scan scan;
  for (int turn = -turns; turn <= turns; ++turn)
    for (int shift = -shifts; shift <= shifts; ++shift) {
      Vector6d motion = Vector6d::Zero();
      motion[kAxialRotation] = turn * options.scan_rotation_step_deg;
      motion[kAxialTranslation] = shift * options.scan_translation_step_mm;
      scan.motions.push_back(motion);
    }
  scan.reach = Vector6d::Ones();
  scan.reach[kAxialRotation] = 2.01 * options.scan_rotation_step_deg;
  scan.reach[kAxialTranslation] = 2.01 * options.scan_translation_step_mm;
  return scan;
}

/// The start itself, and motions in all six axes spread evenly over their ranges (Halton's sequence). For a start that
/// is only approximate in all six axes.
inline Scan scattered_scan(const SearchOptions& options) {
  Vector6d range;
  range << options.scan_side_deg, options.scan_side_deg, options.scan_rotation_deg, options.scan_side_mm,
      options.scan_side_mm, options.scan_translation_mm;
  const auto halton = [](int i, int base) {
    double value = 0, place = 1;
    for (; i > 0; i /= base) value += (place /= base) * (i % base);
    return value;
  };
  Scan scan;
  for (int i = 0; i < options.scan_poses; ++i) {
    Vector6d motion = Vector6d::Zero();
    constexpr std::array<int, 6> kBases{2, 3, 5, 7, 11, 13};
    for (int axis = 0; i > 0 && axis < 6; ++axis)
      motion[axis] = range[axis] * (2 * halton(i, kBases[std::size_t(axis)]) - 1);
    scan.motions.push_back(motion);
  }
  scan.reach = options.scan_reach * range.cwiseMax(1e-9);
  scan.grid = false;
  return scan;
}

}  // namespace marrow::search
