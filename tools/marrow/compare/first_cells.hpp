// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <set>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// Ends a comparison early if it names figures that are not there: what a node's declaration does not say, and what
/// items a search makes, is known from the first cells only. To be told of each row, made now or before.
class FirstCells {
 public:
  explicit FirstCells(const compare::Experiment& experiment) : experiment_(experiment) {}
  /// Throws Error if all variants lack a figure, each case so far does, there are at least two of these (in one alone,
  /// it may be the case), and no cell is done.
  void add(const compare::CellIndex& cell, const compare::CellRow& row);

 private:
  const compare::Experiment& experiment_;
  bool any_done_ = false;
  std::set<std::size_t> variants_, cases_;  ///< with a cell that lacks a figure
};

}  // namespace marrow::cli
