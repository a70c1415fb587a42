// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which cells of a comparison are timed.
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "compare/comparison.hpp"

namespace marrow::cli {

/// The cases and starts in which every variant was done and no node failed. A variant for which there are none does not
/// count. Only these allow to compare amounts of work: otherwise a variant that fails in hard cases would seem faster.
std::set<std::pair<std::string, std::string>> places_done_by_all(const std::vector<RowsOfVariant>& rows);

/// The cells that are timed: of each variant those of the same cases and starts.
class TimedCells {
 public:
  /// `rows` are those of all cells, in the order of cells_of().
  TimedCells(const compare::Experiment& experiment, const std::vector<compare::CellRow>& rows);

  /// Numbers of the cells, in the order in which they are timed. The variants take turns, and their order is reversed
  /// from one case and start to the next, so that none always comes first.
  const std::vector<std::size_t>& numbers() const { return numbers_; }
  /// Removes the times of cases and starts in which not every variant has one, and times that were not measured now.
  void keep_complete(std::vector<compare::CellRow>& rows);
  /// What was measured, for people.
  std::string sentence(bool has_store) const;

 private:
  std::size_t asked_, variants_;
  std::size_t places_ = 0, lost_ = 0;
  bool has_fewer_ = false;   ///< fewer than requested, because some failed
  std::string without_any_;  ///< names of variants that were done nowhere
  std::vector<std::size_t> numbers_;
};

}  // namespace marrow::cli
