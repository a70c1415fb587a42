// SPDX-License-Identifier: Apache-2.0
// Which variants differ, and how they rank.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "compare/comparison.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using compare::Variant;

PairFinding compared(const Experiment& experiment, const std::vector<RowsOfVariant>& rows, std::size_t metric,
                     std::size_t reference, std::size_t variant) {
  const std::vector<compare::Pair> pairs = cell_pairs(rows[reference], rows[variant], metric);
  const bool higher_is_better = experiment.metrics[metric].higher_is_better();
  return {{variant, metric, compare::compare_pairs(pairs, higher_is_better), 1, ""}, reference};
}

/// Those that the experiment asks for, by figure, with p after Holm.
std::vector<PairFinding> asked(const Experiment& experiment, const std::vector<RowsOfVariant>& rows) {
  const std::size_t baseline = experiment.baseline, variants = rows.size();
  std::vector<PairFinding> found;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) {
    for (std::size_t v = 0; v < variants; ++v)
      if (v != baseline) found.push_back(compared(experiment, rows, m, baseline, v));
    for (std::size_t first = 0; experiment.compare_all && first < variants; ++first)
      for (std::size_t second = first + 1; second < variants; ++second)
        if (first != baseline && second != baseline) found.push_back(compared(experiment, rows, m, first, second));
  }
  std::vector<double> p;
  for (const PairFinding& pair : found) p.push_back(pair.finding.comparison.test.p);
  const std::vector<double> corrected = compare::holm(p);
  for (std::size_t i = 0; i < found.size(); ++i) found[i].finding.p_holm = corrected[i];
  return found;
}

void say(const Experiment& experiment, const Answer& answer, Finding& finding, std::size_t comparisons,
         const std::string& reference) {
  const compare::MetricChoice& metric = experiment.metrics[finding.metric];
  finding.sentence = compare::sentence(experiment.variants[finding.variant].name,
                                       {metric.label, answer.units[finding.metric], metric.higher_is_better()},
                                       finding.comparison, {finding.p_holm, comparisons}, 0.05, reference);
}

/// The median of all runs, of which those without the figure are worse than any other.
Ranking::Place place_of(std::size_t variant, const RowsOfVariant& rows, std::size_t metric, bool higher_is_better) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<double> values;
  for (const compare::CellRow* row : rows)
    values.push_back(row->values[metric].value_or(higher_is_better ? -kInfinite : kInfinite));
  std::sort(values.begin(), values.end());
  Ranking::Place place;
  place.variant = variant;
  place.median = values.empty() ? 0 : compare::median_of_differences(values);
  place.lost = std::size_t(std::count_if(values.begin(), values.end(), [](double one) { return std::isinf(one); }));
  return place;
}

/// Rounding noise makes no order.
double without_noise(double median) {
  return std::isfinite(median) ? parsed_number(short_number(median, 9)).value_or(median) : median;
}

Ranking ranking_of(const Experiment& experiment, const std::vector<RowsOfVariant>& rows,
                   const std::vector<PairFinding>& pairs, std::size_t metric) {
  Ranking ranking;
  const bool higher_is_better = experiment.metrics[metric].higher_is_better();
  for (std::size_t v = 0; v < rows.size(); ++v)
    ranking.places.push_back(place_of(v, rows[v], metric, higher_is_better));
  const auto key = [&](const Ranking::Place& one) {
    const double median = without_noise(one.median);
    return std::pair(higher_is_better ? -median : median, one.lost);
  };
  std::stable_sort(ranking.places.begin(), ranking.places.end(),
                   [&](const auto& one, const auto& other) { return key(one) < key(other); });
  std::vector<std::size_t> position(rows.size());
  for (std::size_t i = 0; i < ranking.places.size(); ++i) {
    const bool is_tie = i && key(ranking.places[i]) == key(ranking.places[i - 1]);
    ranking.places[i].rank = is_tie ? ranking.places[i - 1].rank : i + 1;
    position[ranking.places[i].variant] = i;
  }
  std::vector<std::pair<std::size_t, std::size_t>> different;
  for (const auto& [finding, reference] : pairs) {
    if (finding.metric != metric) continue;
    ++ranking.pairs;
    const bool is_shown = compare::difference_shown(finding.comparison, finding.p_holm);
    const std::size_t one = position[reference], other = position[finding.variant];
    if (is_shown) different.emplace_back(one, other);
    if (one && other) continue;
    const bool variant_is_better =
        (finding.comparison.test.positive_ranks > finding.comparison.test.negative_ranks) == higher_is_better;
    const bool first_is_better = variant_is_better == (other == 0);
    if (!is_shown) ranking.like_best.push_back(one ? reference : finding.variant);
    if (is_shown && !first_is_better) ranking.better_than_best.push_back(one ? reference : finding.variant);
  }
  ranking.different = different.size();
  if (const auto letters = compare::letters_of_groups(rows.size(), different))
    for (std::size_t i = 0; i < letters->size(); ++i) ranking.places[i].group = (*letters)[i];
  return ranking;
}

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
std::vector<compare::Pair> compared_pairs(const Experiment& experiment, const std::vector<RowsOfVariant>& rows,
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

void add_findings(const Experiment& experiment, const std::vector<RowsOfVariant>& rows, Answer& answer) {
  std::vector<PairFinding> pairs = asked(experiment, rows);
  for (PairFinding& pair : pairs) {
    if (pair.reference == experiment.baseline) {
      answer.findings.push_back(pair.finding);
      say(experiment, answer, answer.findings.back(), pairs.size(), "");
    }
    say(experiment, answer, pair.finding, pairs.size(), experiment.variants[pair.reference].name);
  }
  if (!experiment.compare_all) return;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m)
    answer.rankings.push_back(ranking_of(experiment, rows, pairs, m));
  answer.pairs = std::move(pairs);
}

// What each factor of a matrix does by itself.

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
                      compare::compare_pairs(compared_pairs(experiment, rows, f, level, m), metric.higher_is_better()),
                      ""};
        effect.sentence = compare::effect_sentence(levels[level], levels[0],
                                                   {"", answer.units[m], metric.higher_is_better()}, effect.comparison);
        answer.effects.push_back(std::move(effect));
      }
    }
  }
}

}  // namespace marrow::cli
