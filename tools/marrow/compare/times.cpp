// SPDX-License-Identifier: Apache-2.0
#include "compare/times.hpp"

#include <algorithm>
#include <thread>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using compare::CellRow;
using compare::Experiment;
using CaseAndStart = std::pair<std::string, std::string>;

bool is_done_without_a_failure(const CellRow& row) { return row.failed.empty() && row.absent.empty(); }

}  // namespace

std::set<CaseAndStart> places_done_by_all(const std::vector<RowsOfVariant>& rows) {
  std::map<CaseAndStart, std::size_t> done;
  std::size_t variants = 0;
  for (const RowsOfVariant& own : rows) {
    bool is_anywhere = false;
    for (const CellRow* row : own) {
      if (!is_done_without_a_failure(*row)) continue;
      ++done[{row->case_name, row->start}];
      is_anywhere = true;
    }
    variants += is_anywhere;
  }
  std::set<CaseAndStart> places;
  for (const auto& [place, count] : done)
    if (count == variants) places.insert(place);
  return places;
}

TimedCells::TimedCells(const Experiment& experiment, const std::vector<CellRow>& rows)
    : asked_(experiment.timed_cells), variants_(experiment.variants.size()) {
  const std::vector<RowsOfVariant> of_variant = rows_by_variant(experiment, rows);
  const std::set<CaseAndStart> by_all = places_done_by_all(of_variant);
  std::vector<std::size_t> timed;  // variants
  for (std::size_t v = 0; v < variants_; ++v) {
    const RowsOfVariant& own = of_variant[v];
    if (std::any_of(own.begin(), own.end(), [](const CellRow* row) { return is_done_without_a_failure(*row); }))
      timed.push_back(v);
    else
      without_any_ += (without_any_.empty() ? "" : ", ") + experiment.variants[v].name;
  }
  std::vector<std::size_t> first_cells;  // of those cases and starts, in the experiment's order
  for (std::size_t i = 0; i < rows.size(); i += variants_)
    if (by_all.contains({rows[i].case_name, rows[i].start})) first_cells.push_back(i);
  places_ = std::min(first_cells.size(), asked_);
  has_fewer_ = places_ < std::min(asked_, rows.size() / variants_);
  for (std::size_t i = 0; i < places_; ++i) {
    for (const std::size_t v : timed) numbers_.push_back(first_cells[i * first_cells.size() / places_] + v);
    std::reverse(timed.begin(), timed.end());
  }
}

void TimedCells::keep_complete(std::vector<CellRow>& rows) {
  std::map<std::size_t, bool> is_complete;  // by case and start
  for (const std::size_t number : numbers_)
    is_complete.try_emplace(number / variants_, true).first->second &= rows[number].seconds.has_value();
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (const auto found = is_complete.find(i / variants_); found == is_complete.end() || !found->second)
      rows[i].seconds.reset();
  for (const auto& [place, complete] : is_complete) lost_ += !complete;
}

std::string TimedCells::sentence(bool has_store) const {
  if (!asked_) return "Times were not measured.";
  std::string text = "Times were not measured";
  text += places_ ? "." : ": there is no case and start in which every variant was done without a failure.";
  if (places_ > lost_)
    text = "Times: " + counted(places_ - lost_, "run") +
           " of each variant, the same cases and starts for all, in turns, one at a time on " +
           counted(std::thread::hardware_concurrency(), "thread") +
           " with nothing else running. Each cell runs once before, which does not count. " +
           (has_store ? "What all variants share is read back, everything else is made anew."
                      : "Everything is made anew, also what all variants share.");
  if (has_fewer_ && places_) text += " In no other case and start was every variant done without a failure.";
  if (!without_any_.empty()) text += " Without times: " + without_any_ + ", which was done nowhere without a failure.";
  if (lost_)
    text += " Left out: " + counted(lost_, "case and start", "cases and starts") +
            " in which a run failed while it was timed.";
  return text;
}

}  // namespace marrow::cli
