// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/diagnostics.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// An option whose numbers are tried over a range.
struct SweptOption {
  std::string key;  ///< node.option
  std::array<double, 2> range{};
  bool is_log = false;    ///< spread evenly over the logarithm
  bool is_whole = false;  ///< rounded to whole numbers
  Place place;

  /// The value at a fraction, 0 to 1, of the range.
  double value_at(double fraction) const;
  /// The fraction of the range at which a value lies; 0 below it, 1 above it.
  double fraction_of(double value) const;
};

/// How numbers of options are chosen: an optimizer tries points on the first cases, the training cases. The others are
/// held out: on them the chosen point is compared with the variants of the file.
struct TuneRule {
  std::vector<SweptOption> options;
  std::size_t variant = 0;  ///< the one whose options are tuned
  std::size_t metric = 0;   ///< the figure whose mean over the training cases and starts is made as good as possible
  double failed_as = 0;     ///< counts for a failed run in that mean, and for a worse one; a magnitude for nearest_zero
  std::string optimizer;    ///< name of the node that chooses the points
  std::vector<std::pair<std::string, std::string>> optimizer_options;  ///< as texts in YAML
  Place optimizer_place;
  std::size_t points = 0;  ///< the most that the optimizer may try
  std::size_t training_cases = 0;

  /// The values of the options at fractions of their ranges, rounded to about a thousandth of the range. So names are
  /// short, and points that are nearly equal become one.
  std::vector<double> values_at(const std::vector<double>& fractions) const;
};

}  // namespace compare
}  // namespace marrow
