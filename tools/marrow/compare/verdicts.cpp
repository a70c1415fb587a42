// SPDX-License-Identifier: Apache-2.0
// What the verdicts of a comparison's cells are worth: silent failures and false alarms.
#include <algorithm>
#include <cstdio>

#include "compare/comparison.hpp"
#include "marrow/domain/number_text.hpp"
#include "marrow/domain/printable.hpp"

namespace marrow::cli {

VerdictCounts verdict_counts(const compare::Experiment& experiment, const std::vector<const compare::CellRow*>& rows) {
  VerdictCounts counts;
  compare::CaseRate silent, false_alarms;
  for (const compare::CellRow* row : rows) {
    if (!row->verdict) continue;
    const bool is_success = row->is_success(experiment), is_trusted = *row->verdict == Judgement::trusted;
    ++counts.cells;
    if (is_success)
      false_alarms.add(row->case_name, !is_trusted);
    else
      silent.add(row->case_name, is_trusted);
  }
  counts.misses = silent.runs();
  counts.silent = silent.successes();
  counts.false_alarms = false_alarms.successes();
  if (silent.runs()) counts.silent_rate = silent.interval();
  if (false_alarms.runs()) counts.false_alarm_rate = false_alarms.interval();
  return counts;
}

std::string verdict_table(const compare::Experiment& experiment, const Answer& answer) {
  std::size_t width = 10, cells = 0;
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    width = std::max(width, experiment.variants[v].name.size() + 2);
    cells += answer.variants[v].verdicts.cells;
  }
  if (!cells) return "";
  const auto rate = [](std::size_t count, std::size_t of, const compare::Interval& interval) -> std::string {
    if (!of) return "-";
    return formatted("%zu/%zu (%.1f to %.1f %%)", count, of, 100 * interval.lower, 100 * interval.upper);
  };
  char line[400];
  std::snprintf(line, sizeof line, "%-*s %5s  %-26s %6s  %s\n", int(width), "", "cells", "silent failures", "caught",
                "false alarms");
  std::string text =
      std::string("\nVerdicts: misses that are trusted, of all misses; successes that are not, of all successes\n") +
      line;
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VerdictCounts& counts = answer.variants[v].verdicts;
    std::snprintf(line, sizeof line, "%-*s %5zu  %-26s %6zu  %s\n", int(width), experiment.variants[v].name.c_str(),
                  counts.cells, rate(counts.silent, counts.misses, counts.silent_rate).c_str(), counts.caught(),
                  rate(counts.false_alarms, counts.successes(), counts.false_alarm_rate).c_str());
    text += line;
  }
  return text;
}

}  // namespace marrow::cli
