// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/compare/swept_option.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// How numbers of options are chosen: an optimizer tries points on the first cases, the training cases. The others are
/// held out: on them the chosen point is compared with the variants of the file.
struct TuneRule {
  std::vector<SweptOption> options;
  std::size_t variant = 0;  ///< the one whose options are tuned
  std::size_t metric = 0;   ///< the figure whose mean over the training cases and starts is made as good as possible
  double failed_as = 0;     ///< what a failed run counts as in that mean, and a worse one; a magnitude for nearest_zero
  std::string optimizer;    ///< name of the node that chooses the points
  std::vector<std::pair<std::string, std::string>> optimizer_options;  ///< as texts in YAML
  Place optimizer_place;
  std::size_t points = 0;  ///< the most that the optimizer may try
  std::size_t training_cases = 0;

  /// The values of the options at fractions of their ranges, rounded to about a thousandth of the range, so that names
  /// are short and points that are nearly equal are one.
  std::vector<double> values_at(const std::vector<double>& fractions) const;
};

}  // namespace compare
}  // namespace marrow
