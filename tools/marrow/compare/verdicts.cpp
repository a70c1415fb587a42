// SPDX-License-Identifier: Apache-2.0
// What the verdicts of a comparison's cells are worth: silent failures and false alarms.
#include "compare/comparison.hpp"
#include "compare/figure_text.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {

VerdictCounts verdict_counts(const compare::Experiment& experiment, const std::vector<const compare::CellRow*>& rows) {
  VerdictCounts counts;
  compare::CaseRate silent, false_alarms;
  for (const compare::CellRow* row : rows) {
    if (!row->verdict) continue;
    ++counts.cells;
    if (!experiment.defines_success()) continue;
    const bool is_trusted = *row->verdict == Judgement::trusted;
    if (row->is_success(experiment))
      false_alarms.add(row->case_name, !is_trusted);
    else
      silent.add(row->case_name, is_trusted);
  }
  counts.misses = silent.runs();
  counts.successes = false_alarms.runs();
  counts.silent = silent.successes();
  counts.false_alarms = false_alarms.successes();
  if (silent.runs()) counts.silent_rate = silent.interval();
  if (false_alarms.runs()) counts.false_alarm_rate = false_alarms.interval();
  return counts;
}

std::string verdict_table(const compare::Experiment& experiment, const Answer& answer) {
  std::size_t cells = 0;
  for (const VariantSummary& summary : answer.variants) cells += summary.verdicts.cells;
  if (!cells) return "";
  using enum Side;
  TextTable table({left, right, left, right, left});
  table.add({"", "cells", "silent failures", "caught", "false alarms"});
  for (std::size_t v = 0; v < answer.variants.size(); ++v) {
    const VerdictCounts& counts = answer.variants[v].verdicts;
    table.add({experiment.variants[v].name, formatted("{}", counts.cells),
               rate_text(counts.silent, counts.misses, counts.silent_rate, 1),
               experiment.defines_success() ? formatted("{}", counts.caught()) : "-",
               rate_text(counts.false_alarms, counts.successes, counts.false_alarm_rate, 1)});
  }
  return "\nVerdicts: misses that are trusted, of all misses; successes that are not, of all successes\n" +
         table.text();
}

}  // namespace marrow::cli
