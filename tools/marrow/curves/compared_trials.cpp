// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "curves/compared_sequences.hpp"
#include "curves/sequence_table.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

constexpr double kSameTime = 0.05;  // of a step

double value_at(const compare::PairedCurves& pair, double at) {
  const auto after = std::lower_bound(pair.at.begin(), pair.at.end(), at - kSameTime * pair.step);
  if (after == pair.at.end() || *after > at + kSameTime * pair.step) return kNoValue;
  return pair.difference[std::size_t(after - pair.at.begin())];
}

/// The mean difference of a trial's repetitions that have one at this time.
double mean_at(const std::vector<const ComparedFigure*>& repetitions, double at) {
  double sum = 0, count = 0;
  for (const ComparedFigure* one : repetitions)
    if (const double value = value_at(one->pair, at); std::isfinite(value)) {
      sum += value;
      ++count;
    }
  return count > 0 ? sum / count : kNoValue;
}

using Repetitions = std::map<std::string, std::vector<const ComparedFigure*>>;  ///< by trial

void find_outside(TrialFigure& figure) {
  bool is_outside = false;
  for (std::size_t i = 0; i < figure.at.size(); ++i) {
    const bool now = std::abs(figure.band->mean[i]) > figure.band->simultaneous[i];
    if (now && !is_outside) figure.outside.push_back({figure.at[i], figure.at[i]});
    if (now) figure.outside.back().second = figure.at[i];
    is_outside = now;
  }
}

TrialFigure figure_of(const Repetitions& trials) {
  const ComparedFigure& model = *trials.begin()->second.front();
  TrialFigure figure{model.name, model.unit, model.in_seconds, {}, {}, {}, 0, {}, {}, {}};
  for (const auto& [name, repetitions] : trials) figure.trials.push_back(name);
  figure.differences.resize(trials.size());
  for (const double at : model.pair.at) {
    std::vector<double> values;
    for (const auto& [name, repetitions] : trials) values.push_back(mean_at(repetitions, at));
    if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); })) continue;
    figure.at.push_back(at);
    for (std::size_t i = 0; i < values.size(); ++i) figure.differences[i].push_back(values[i]);
  }
  if (figure.at.empty()) throw Error("there is no time at which all trials have a difference");
  std::vector<double> means;
  for (const std::vector<double>& curve : figure.differences) {
    double sum = 0;
    for (const double value : curve) sum += value;
    means.push_back(sum / double(curve.size()));
    figure.bias += means.back() / double(trials.size());
  }
  figure.interval = compare::mean_of_trials(means);
  if (trials.size() >= compare::kFewestTrials) {
    figure.band = compare::mean_band(figure.differences);
    find_outside(figure);
  }
  return figure;
}

}  // namespace

ComparedTrials compare_trials(const std::vector<TrialPair>& pairs, const CurveSettings& settings) {
  std::vector<ComparedSequences> compared;
  for (const TrialPair& pair : pairs) compared.push_back(compare_sequences(pair.first, pair.second, settings));
  std::vector<std::string> order;
  std::map<std::string, Repetitions> by_figure;
  ComparedTrials result;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const std::string trial = pairs[i].name.substr(0, pairs[i].name.find('/'));
    for (const std::string& note : compared[i].notes) result.notes.push_back(pairs[i].name + ": " + note);
    for (const ComparedFigure& figure : compared[i].figures) {
      if (!by_figure.contains(figure.name)) order.push_back(figure.name);
      by_figure[figure.name][trial].push_back(&figure);
    }
  }
  std::string fault;
  for (const std::string& name : order) {
    try {
      result.figures.push_back(figure_of(by_figure[name]));
    } catch (const Error& error) {
      if (fault.empty()) fault = "'" + name + "': " + error.what();
      result.notes.push_back("'" + name + "' is left out: " + error.what());
    }
  }
  if (result.figures.empty()) throw Error("no figure of the trials could be compared; " + fault);
  return result;
}

}  // namespace marrow::cli
