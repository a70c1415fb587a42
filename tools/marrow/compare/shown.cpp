// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <set>

#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

/// A case and a start.
using CellPlace = std::pair<std::size_t, std::size_t>;

/// Chooses places, each once, until there are enough.
class Chooser {
 public:
  explicit Chooser(std::size_t most) : most_(most) {}
  void add(const CellPlace& place) {
    if (places_.size() < most_ && taken_.insert(place).second) places_.push_back(place);
  }
  /// The first place of each list, then the second ones, and so on.
  void add_in_turn(const std::vector<std::vector<CellPlace>>& lists) {
    std::size_t longest = 0;
    for (const auto& list : lists) longest = std::max(longest, list.size());
    for (std::size_t i = 0; i < longest; ++i)
      for (const auto& list : lists)
        if (i < list.size()) add(list[i]);
  }
  const std::vector<CellPlace>& places() const { return places_; }

 private:
  std::size_t most_;
  std::vector<CellPlace> places_;
  std::set<CellPlace> taken_;
};

/// The rows without the first figure, the first one with each reason before all others.
std::vector<std::size_t> failed_rows(const std::vector<compare::CellRow>& rows) {
  std::vector<std::size_t> first, others;
  std::set<std::string> reasons;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!rows[i].values.at(0)) (reasons.insert(rows[i].failed + rows[i].absent).second ? first : others).push_back(i);
  first.insert(first.end(), others.begin(), others.end());
  return first;
}

}  // namespace

std::vector<compare::CellIndex> cells_to_show(const compare::Experiment& experiment,
                                              const std::vector<compare::CellRow>& rows, std::size_t most) {
  const std::size_t variants = experiment.variants.size(), starts = experiment.starts.size();
  const auto place_of = [&](std::size_t row) { return CellPlace{row / variants / starts, row / variants % starts}; };
  std::vector<std::vector<std::size_t>> by_value(variants);  // for each variant, its rows with a value, the best first
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].values.at(0)) by_value[i % variants].push_back(i);
  for (auto& order : by_value)
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return experiment.metrics[0].higher_is_better() ? *rows[a].values[0] > *rows[b].values[0]
                                                      : *rows[a].values[0] < *rows[b].values[0];
    });

  const auto at_rank = [&](double rank) {
    std::vector<CellPlace> places;
    for (const auto& order : by_value)
      if (!order.empty()) places.push_back(place_of(order[std::size_t(std::lround(rank * double(order.size() - 1)))]));
    return places;
  };
  std::vector<CellPlace> failed;
  for (const std::size_t row : failed_rows(rows)) failed.push_back(place_of(row));
  Chooser chooser(most);
  chooser.add_in_turn({at_rank(1), at_rank(0.5), failed, at_rank(0)});  // worst, median, failed, best
  for (std::size_t i = 0; i < rows.size(); i += variants) chooser.add(place_of(i));

  std::vector<compare::CellIndex> cells;
  for (const auto& [case_index, start] : chooser.places())
    for (std::size_t v = 0; v < variants; ++v)
      if (rows[(case_index * starts + start) * variants + v].failed.empty()) cells.push_back({v, case_index, start});
  return cells;
}

}  // namespace marrow::cli
