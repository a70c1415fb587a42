// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "marrow/base/export.hpp"

// Two curves over time on common times, so that they can be subtracted.
namespace MARROW_EXPORT marrow {
namespace compare {

/// A figure over time. NaN is a gap: a frame without a value.
struct Curve {
  std::vector<double> at;  ///< seconds, or numbers of frames; rising
  std::vector<double> values;
};

/// Two curves at the same times. All lists have the same length, and NaN is a gap.
struct PairedCurves {
  enum class Interpolated { none, first, second };

  std::vector<double> at;
  std::vector<double> first, second;
  std::vector<double> difference;  ///< second - first; a gap where either is one
  double step = 0;                 ///< median distance between the slower curve's times
  Interpolated interpolated = Interpolated::none;
};

/// If the times of both lie on one raster (within 5 % of a step), nothing is interpolated: the common times are those
/// of either. Otherwise they are the times of the slower curve, or of the first one of equally fast ones. The other
/// curve is read there, by linear interpolation between two neighbours that are no farther apart than 1.5 of its steps;
/// no value comes from across a gap.
///
/// Throws Error if a curve has fewer than two times, if they do not rise, if there are not as many values, or if the
/// two do not overlap in time.
PairedCurves pair_curves(const Curve& first, const Curve& second);

}  // namespace compare
}  // namespace marrow
