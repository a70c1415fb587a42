// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>

#include "curves/curves.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

using Repetitions = std::map<std::string, std::vector<const ComparedFigure*>>;  ///< by trial

/// The same figure of both recordings.
struct FigurePair {
  const FigureOverTime *first, *second;
};

template <class T>
const T* named(const std::vector<T>& all, const std::string& name) {
  const auto found = std::find_if(all.begin(), all.end(), [&](const T& one) { return one.name == name; });
  return found == all.end() ? nullptr : &*found;
}

std::vector<FigureOverTime> figures_of(const PosesOverTime& poses, const Eigen::Matrix3d& world_from_reference) {
  static constexpr const char* kNames[] = {"x_mm", "y_mm", "z_mm", "turn_x_deg", "turn_y_deg", "turn_z_deg"};
  std::vector<FigureOverTime> figures;
  for (int k = 0; k < 6; ++k) {
    figures.push_back(
        {poses.name.empty() ? kNames[k] : poses.name + "." + kNames[k], k < 3 ? "mm" : "deg", poses.times, {}});
    for (const auto& pose : poses.world_from_model) {
      if (!pose)
        figures.back().values.push_back(kNoValue);
      else if (k < 3)
        figures.back().values.push_back(pose->translation_mm[k]);
      else
        figures.back().values.push_back(
            degrees(vector_from_rotation(pose->rotation * world_from_reference.transpose())[k - 3]));
    }
  }
  return figures;
}

/// The first known rotation, from which both recordings are turned.
Eigen::Matrix3d reference_of(const PosesOverTime& poses) {
  for (const auto& pose : poses.world_from_model)
    if (pose) return pose->rotation;
  return Eigen::Matrix3d::Identity();
}

/// All figures of both recordings, with those of their poses.
struct Both {
  std::vector<FigureOverTime> first, second;

  Both(const Recording& one, const Recording& other) : first(one.figures), second(other.figures) {
    for (const PosesOverTime& poses : one.poses) {
      const Eigen::Matrix3d reference = reference_of(poses);
      for (FigureOverTime& figure : figures_of(poses, reference)) first.push_back(std::move(figure));
      if (const PosesOverTime* others = named(other.poses, poses.name))
        for (FigureOverTime& figure : figures_of(*others, reference)) second.push_back(std::move(figure));
    }
    for (const PosesOverTime& poses : other.poses)
      if (!named(one.poses, poses.name))
        for (FigureOverTime& figure : figures_of(poses, reference_of(poses))) second.push_back(std::move(figure));
  }
};

std::vector<std::string> names_of(const std::vector<FigureOverTime>& figures) {
  std::vector<std::string> names;
  for (const FigureOverTime& figure : figures) names.push_back(figure.name);
  return names;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(names.size(), 8); ++i) text += (i ? ", '" : "'") + names[i] + "'";
  return text + (names.size() > 8 ? formatted(" and {} more", names.size() - 8) : "");
}

[[noreturn]] void refuse_strangers(const Recording& first, const Recording& second, const Both& both) {
  std::string near;
  for (const std::string& name : names_of(both.second))
    if (near.empty() && !nearest_name(name, names_of(both.first)).empty())
      near = "; '" + name + "' of the second is near '" + nearest_name(name, names_of(both.first)) + "' of the first";
  throw Error(formatted("{} and {} have no figure over time in common; the first has {}; the second has {}{}",
                        first.name, second.name, listed(names_of(both.first)), listed(names_of(both.second)), near));
}

bool is_of(const std::string& figure, const std::string& wanted) {
  return figure == wanted || figure.starts_with(wanted + ".") || figure.starts_with(wanted + "/");
}

std::vector<FigurePair> common_figures(const Recording& first, const Recording& second, const Both& both,
                                       const std::vector<std::string>& wanted) {
  std::vector<FigurePair> common;
  std::vector<std::string> names;
  for (const FigureOverTime& figure : both.first)
    if (const FigureOverTime* other = named(both.second, figure.name);
        other && named(both.first, figure.name) == &figure) {
      common.push_back({&figure, other});
      names.push_back(figure.name);
    }
  if (common.empty()) refuse_strangers(first, second, both);
  for (const std::string& want : wanted)
    if (std::none_of(names.begin(), names.end(), [&](const std::string& name) { return is_of(name, want); }))
      throw Error("no figure over time that both have is called '" + want + "'; " + suggestion(want, names));
  if (!wanted.empty())
    std::erase_if(common, [&](const FigurePair& pair) {
      return std::none_of(wanted.begin(), wanted.end(),
                          [&](const std::string& want) { return is_of(pair.first->name, want); });
    });
  return common;
}

bool in_seconds(const FigurePair& pair, TimeBase by, const std::string& name) {
  const bool known = !pair.first->times.seconds.empty() && !pair.second->times.seconds.empty();
  if (by == TimeBase::seconds && !known)
    throw Error("'" + name + "': the seconds of its frames are not known in both; leave out --by seconds");
  return known && by != TimeBase::frames;
}

compare::Curve curve_of(const FigureOverTime& figure, bool seconds, double earlier) {
  compare::Curve curve{seconds ? figure.times.seconds : figure.times.frames, figure.values};
  for (double& at : curve.at) at -= earlier;
  return curve;
}

void note_once(std::vector<std::string>& notes, const std::string& note) {
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
}

ComparedFigure compared(const FigurePair& given, const CurveSettings& settings, std::vector<std::string>& notes) {
  const std::string& name = given.first->name;
  ComparedFigure figure{name, given.first->unit, in_seconds(given, settings.by, name), {}, {}};
  if (given.second->unit != figure.unit)
    throw Error("its unit is '" + figure.unit + "' in the first and '" + given.second->unit + "' in the second");
  figure.pair = pair_curves(curve_of(*given.first, figure.in_seconds, 0),
                            curve_of(*given.second, figure.in_seconds, settings.lag));
  figure.difference = difference_of(figure.pair);
  const bool one_knows = given.first->times.seconds.empty() != given.second->times.seconds.empty();
  if (one_knows && settings.by != TimeBase::frames)
    note_once(notes,
              "only one of the two says at which second its frames are, so frames are compared by their numbers");
  if (figure.pair.interpolated != compare::PairedCurves::Interpolated::none) {
    const bool is_first = figure.pair.interpolated == compare::PairedCurves::Interpolated::first;
    note_once(notes, formatted("the times differ: the {} sequence was interpolated linearly at those of the {}",
                               is_first ? "first" : "second", is_first ? "second" : "first"));
  }
  return figure;
}

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

const char* time_unit(bool in_seconds) { return in_seconds ? "s" : "frame"; }

ComparedSequences compare_sequences(const Recording& first, const Recording& second, const CurveSettings& settings) {
  expect_sequence(first);
  expect_sequence(second);
  const Both both(first, second);
  ComparedSequences result{first.name, second.name, {}, {}};
  std::string fault;
  for (const FigurePair& pair : common_figures(first, second, both, settings.figures)) {
    try {
      result.figures.push_back(compared(pair, settings, result.notes));
    } catch (const Error& error) {
      if (fault.empty()) fault = "'" + pair.first->name + "': " + error.what();
      result.notes.push_back("'" + pair.first->name + "' is left out: " + error.what());
    }
  }
  if (result.figures.empty())
    throw Error("no figure of " + first.name + " and " + second.name + " could be compared; " + fault);
  return result;
}

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
