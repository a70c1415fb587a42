// SPDX-License-Identifier: Apache-2.0
#include "compare/figure_units.hpp"

#include "marrow/base/error.hpp"

namespace marrow::cli {
namespace {

std::string unit_in_words(const std::string& unit) { return unit.empty() ? "no unit" : "the unit '" + unit + "'"; }

}  // namespace

FigureUnits::FigureUnits(const compare::Experiment& experiment) {
  for (const compare::MetricChoice& metric : experiment.metrics) figures_.push_back({metric.path, "", ""});
  figures_.push_back({experiment.initial_error, "", ""});
}

void FigureUnits::add(const std::vector<compare::CellRow>& rows) {
  for (const compare::CellRow& row : rows) {
    for (std::size_t m = 0; m + 1 < figures_.size(); ++m)
      if (row.values[m]) add(figures_[m], row.units[m], row.id);
    if (row.initial_error) add(figures_.back(), row.initial_error_unit, row.id);
  }
}

void FigureUnits::add(Figure& figure, const std::string& unit, const std::string& cell) {
  if (figure.cell.empty()) {
    figure.unit = unit;
    figure.cell = cell;
  }
  if (unit == figure.unit) return;
  throw Error("the figure '" + figure.path + "' has " + unit_in_words(figure.unit) + " in the cell " + figure.cell +
              " and " + unit_in_words(unit) + " in the cell " + cell +
              ", so their numbers cannot be compared; let all cells give it in one unit");
}

std::vector<std::string> FigureUnits::of_metrics() const {
  std::vector<std::string> units;
  for (std::size_t m = 0; m + 1 < figures_.size(); ++m) units.push_back(figures_[m].unit);
  return units;
}

}  // namespace marrow::cli
