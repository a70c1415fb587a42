// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

/// A case and a start.
using Place = std::pair<std::size_t, std::size_t>;

class Chooser {
 public:
  explicit Chooser(std::size_t most) : most_(most) {}
  void add(const Place& place) {
    if (places_.size() < most_ && std::find(places_.begin(), places_.end(), place) == places_.end())
      places_.push_back(place);
  }
  std::vector<Place> sorted() {
    std::sort(places_.begin(), places_.end());
    return places_;
  }

 private:
  std::size_t most_;
  std::vector<Place> places_;
};

}  // namespace

std::vector<compare::CellIndex> cells_to_show(const compare::Experiment& experiment,
                                              const std::vector<compare::CellRow>& rows, std::size_t most) {
  const std::size_t variants = experiment.variants.size(), starts = experiment.starts.size();
  const auto place_of = [&](std::size_t row) { return Place{row / variants / starts, row / variants % starts}; };
  std::vector<std::vector<std::size_t>> by_value(variants);  // for each variant, its rows with a value, the best first
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].failed.empty() && rows[i].values.at(0)) by_value[i % variants].push_back(i);
  for (auto& order : by_value)
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return experiment.metrics[0].higher_is_better() ? *rows[a].values[0] > *rows[b].values[0]
                                                      : *rows[a].values[0] < *rows[b].values[0];
    });

  Chooser chooser(most);
  for (const double rank : {1.0, 0.5, 0.0})  // worst, median, best
    for (const auto& order : by_value)
      if (!order.empty()) chooser.add(place_of(order[std::size_t(std::lround(rank * double(order.size() - 1)))]));
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!rows[i].failed.empty()) chooser.add(place_of(i));
  for (std::size_t i = 0; i < rows.size(); ++i) chooser.add(place_of(i));

  std::vector<compare::CellIndex> cells;
  for (const auto& [case_index, start] : chooser.sorted())
    for (std::size_t v = 0; v < variants; ++v)
      if (rows[(case_index * starts + start) * variants + v].failed.empty()) cells.push_back({v, case_index, start});
  return cells;
}

}  // namespace marrow::cli
