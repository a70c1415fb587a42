// SPDX-License-Identifier: Apache-2.0
#pragma once
// The units in which the cells of a comparison give their figures.
#include <string>
#include <vector>

#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// The unit of each figure of an experiment. Numbers in metres and in millimetres are never put together.
class FigureUnits {
 public:
  explicit FigureUnits(const compare::Experiment& experiment);

  /// Takes the units of rows of this experiment, or of one with the same figures. Throws Error if a figure has another
  /// unit in one cell than in another, also if it has none in one of them. Cells without the figure do not count.
  void add(const std::vector<compare::CellRow>& rows);

  /// Of the experiment's metrics, in their order; empty for a number without a unit, and if no row has the figure.
  std::vector<std::string> of_metrics() const;
  /// Of the figure under 'initial_error'.
  const std::string& of_initial_error() const { return figures_.back().unit; }

 private:
  struct Figure {
    std::string path, unit;
    std::string cell;  ///< the first one that has it; empty if there is none yet
  };
  static void add(Figure& figure, const std::string& unit, const std::string& cell);

  std::vector<Figure> figures_;  ///< the metrics, and the initial error
};

}  // namespace marrow::cli
