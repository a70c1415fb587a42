// SPDX-License-Identifier: Apache-2.0
// The figures of a comparison's rows, as the statistics take them.
#include "compare/comparison.hpp"
#include "marrow/compare/median_interval.hpp"

namespace marrow::cli {

using compare::CellRow;

std::vector<RowsOfVariant> rows_by_variant(const compare::Experiment& experiment, const std::vector<CellRow>& rows) {
  std::map<std::string, std::size_t> places;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v) places[experiment.variants[v].name] = v;
  std::vector<RowsOfVariant> result(experiment.variants.size());
  for (const CellRow& row : rows)
    if (const auto place = places.find(row.variant); place != places.end()) result[place->second].push_back(&row);
  return result;
}

FigureOfCases figure_of_cases(const RowsOfVariant& rows, std::size_t metric) {
  std::map<std::string, std::vector<double>> by_case;
  FigureOfCases figure;
  for (const CellRow* row : rows)
    if (row->values[metric]) {
      by_case[row->case_name].push_back(*row->values[metric]);
      figure.all.push_back(*row->values[metric]);
    }
  for (auto& [name, values] : by_case) figure.cases.push_back(std::move(values));
  return figure;
}

std::optional<compare::Interval> FigureOfCases::median_interval(double confidence) const {
  if (cases.empty()) return std::nullopt;
  return compare::median_interval_of(cases, confidence);
}

std::vector<compare::Pair> cell_pairs(const RowsOfVariant& baseline, const RowsOfVariant& variant, std::size_t metric) {
  std::map<std::pair<std::string, std::string>, compare::Pair> by_place;
  const auto pair_of = [&](const CellRow& row) -> compare::Pair& {
    compare::Pair& pair = by_place[{row.case_name, row.start}];
    pair.case_name = row.case_name;
    return pair;
  };
  for (const CellRow* row : baseline) pair_of(*row).reference = row->values[metric];
  for (const CellRow* row : variant) pair_of(*row).variant = row->values[metric];
  std::vector<compare::Pair> pairs;
  for (auto& [place, pair] : by_place) pairs.push_back(std::move(pair));
  return pairs;
}

}  // namespace marrow::cli
