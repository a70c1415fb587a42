// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/compare/experiment_notes.hpp"

namespace marrow::compare {

void set_factors(Experiment& experiment, const std::vector<std::vector<Override>>& columns,
                 std::vector<Variant>& combined) {
  if (!experiment.variants.empty()) {
    Factor& named = experiment.factors.emplace_back("variants");
    for (const Variant& variant : experiment.variants) named.levels.push_back(variant.name);
  }
  for (const std::vector<Override>& column : columns) {
    Factor& factor = experiment.factors.emplace_back(column.front().key);
    for (const Override& one : column) factor.levels.push_back(one.value);
  }
  for (std::size_t v = 0; v < combined.size(); ++v) {
    combined[v].levels.resize(experiment.factors.size());
    std::size_t rest = v;
    for (std::size_t f = experiment.factors.size(); f-- > 0; rest /= experiment.factors[f].levels.size())
      combined[v].levels[f] = rest % experiment.factors[f].levels.size();
  }
}

void read_compare_all(StrictYaml& yaml, const YamlEntry& entry, Experiment& experiment) {
  experiment.compare_all = yaml.boolean(entry.value, entry.place, "compare_all").value_or(false);
  experiment.compare_all_place = entry.place;
}

void check_compare_all(StrictYaml& yaml, const Experiment& experiment) {
  const std::size_t comparisons = comparison_counts(experiment).comparisons;
  if (!experiment.compare_all || comparisons <= kMostComparisons) return;
  yaml.fault(
      experiment.compare_all_place,
      formatted("all pairs of {} variants in {} are {} comparisons, at most {} can be made", experiment.variants.size(),
                counted(experiment.metrics.size(), "figure"), comparisons, kMostComparisons),
      "leave variants or figures out, or compare each with the baseline alone");
}

}  // namespace marrow::compare
