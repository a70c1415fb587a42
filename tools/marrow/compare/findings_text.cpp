// SPDX-License-Identifier: Apache-2.0
// All pairs, the rankings and the effects of factors for the terminal.
#include <algorithm>
#include <cmath>

#include "compare/comparison.hpp"
#include "compare/text_table.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;

constexpr std::size_t kMostPairs = 200;  // sentences of pairs; all are in comparison.json

std::string names_text(const Experiment& experiment, const std::vector<std::size_t>& variants) {
  std::vector<std::string> names;
  for (const std::size_t variant : variants) names.push_back(experiment.variants[variant].name);
  return joined(names, ", ");
}

std::string metric_title(const Experiment& experiment, const Answer& answer, std::size_t m) {
  return experiment.metrics[m].label + (answer.units[m].empty() ? "" : " [" + answer.units[m] + "]");
}

/// The pairs without the baseline, whose sentences stand above. Those that differ come first.
std::string sentences_of_pairs(const Experiment& experiment, const Answer& answer) {
  std::vector<const Finding*> others;
  for (const auto& [finding, reference] : answer.pairs)
    if (reference != experiment.baseline) others.push_back(&finding);
  if (others.empty()) return "";
  std::stable_partition(others.begin(), others.end(),
                        [](const Finding* one) { return compare::difference_shown(one->comparison, one->p_holm); });
  std::string text = "\nThe other pairs, in the same correction; those that differ come first\n";
  for (std::size_t i = 0; i < std::min(others.size(), kMostPairs); ++i)
    text += "  " + printable(others[i]->sentence) + "\n";
  if (others.size() > kMostPairs) text += formatted("  and {} more, in comparison.json\n", others.size() - kMostPairs);
  return text;
}

std::string ranking_text(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const Ranking& ranking = answer.rankings[m];
  std::vector<double> medians;
  for (const Ranking::Place& place : ranking.places) medians.push_back(place.median);
  const NumberScale scale(medians);
  const bool has_groups = ranking.places.empty() || !ranking.places[0].group.empty();
  using enum Side;
  TextTable table({right, left, right, right, left});
  table.add({"", "", "median", "lost", "groups"});
  for (const Ranking::Place& place : ranking.places)
    table.add({formatted("{}", place.rank), experiment.variants[place.variant].name,
               std::isfinite(place.median) ? scale.text(place.median) : "a failure", formatted("{}", place.lost),
               has_groups ? place.group : "-"});
  return "\nRanking by " + printable(metric_title(experiment, answer, m)) +
         "; a lost run counts as worse than any other; no test tells apart those that share a letter\n" + table.text() +
         printable(ranking_sentence(experiment, answer, m)) + "\n";
}

}  // namespace

std::string ranking_sentence(const Experiment& experiment, const Answer& answer, std::size_t m) {
  const Ranking& ranking = answer.rankings[m];
  std::string text =
      "best in " + experiment.metrics[m].label + ": " + experiment.variants[ranking.places.front().variant].name;
  text += formatted("; {} of {} pairs differ", ranking.different, ranking.pairs);
  if (!ranking.better_than_best.empty())
    text += "; shown to be better than it, compared case by case: " + names_text(experiment, ranking.better_than_best);
  text += "; not told apart from it: " +
          (ranking.like_best.empty() ? std::string("none") : names_text(experiment, ranking.like_best));
  return text;
}

std::string pairs_text(const Experiment& experiment, const Answer& answer) {
  std::string text = sentences_of_pairs(experiment, answer);
  for (std::size_t m = 0; m < answer.rankings.size(); ++m) text += ranking_text(experiment, answer, m);
  return text;
}

std::string effects_text(const Experiment& experiment, const Answer& answer) {
  std::string text;
  const Effect* before = nullptr;
  for (const Effect& effect : answer.effects) {
    if (!before || before->metric != effect.metric)
      text += "\nWhat each factor does to " + printable(metric_title(experiment, answer, effect.metric)) +
              ", averaged over the others; each interval by itself\n";
    text += "  " + printable(experiment.factors[effect.factor].name + ": " + effect.sentence) + "\n";
    before = &effect;
  }
  return text;
}

}  // namespace marrow::cli
