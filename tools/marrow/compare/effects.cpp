// SPDX-License-Identifier: Apache-2.0
// What each factor of a matrix does by itself.
#include <map>

#include "compare/comparison.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using compare::Variant;

/// All that a variant has beside one factor: the levels of the others, and the values of swept options.
using Others = std::pair<std::vector<std::size_t>, std::vector<double>>;

Others others_of(const Variant& variant, std::size_t factor) {
  Others others{variant.levels, variant.swept};
  others.first[factor] = 0;
  return others;
}

/// The variants with a level of the factor, by what they have beside it.
std::map<Others, std::size_t> with_level(const Experiment& experiment, std::size_t factor, std::size_t level) {
  std::map<Others, std::size_t> found;
  for (std::size_t v = 0; v < experiment.variants.size(); ++v)
    if (const Variant& variant = experiment.variants[v]; !variant.levels.empty() && variant.levels[factor] == level)
      found[others_of(variant, factor)] = v;
  return found;
}

/// A case's pairs are those of all its starts with all combinations of the other factors.
std::vector<compare::Pair> pairs_of(const Experiment& experiment, const std::vector<RowsOfVariant>& rows,
                                    std::size_t factor, std::size_t level, std::size_t metric) {
  const auto first = with_level(experiment, factor, 0);
  std::vector<compare::Pair> pairs;
  for (const auto& [others, variant] : with_level(experiment, factor, level)) {
    const std::vector<compare::Pair> own = cell_pairs(rows[first.at(others)], rows[variant], metric);
    pairs.insert(pairs.end(), own.begin(), own.end());
  }
  return pairs;
}

}  // namespace

void add_effects(const Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer) {
  std::size_t varied = 0;
  for (const compare::Factor& factor : experiment.factors) varied += factor.levels.size() > 1;
  if (varied < 2) return;  // the comparisons of the variants are its effects
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    const compare::MetricChoice& metric = experiment.metrics[m];
    for (std::size_t f = 0; f < experiment.factors.size(); ++f) {
      const std::vector<std::string>& levels = experiment.factors[f].levels;
      for (std::size_t level = 1; level < levels.size(); ++level) {
        Effect effect{f, level, m,
                      compare::compare_pairs(pairs_of(experiment, rows, f, level, m), metric.higher_is_better()), ""};
        effect.sentence = compare::effect_sentence(levels[level], levels[0],
                                                   {"", answer.units[m], metric.higher_is_better()}, effect.comparison);
        answer.effects.push_back(std::move(effect));
      }
    }
  }
}

}  // namespace marrow::cli
