// SPDX-License-Identifier: Apache-2.0
// Response curves: how a figure depends on an option that an experiment sweeps.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "compare/comparison.hpp"
#include "marrow/runtime/pipeline/pipeline_names.hpp"

namespace marrow::cli {
namespace {

using compare::Experiment;
using nlohmann::json;

constexpr std::size_t kBins = 8;  // of Sobol's points, which all have other values

/// Where a value of an option belongs on its curve: the value itself on a grid, else the number of its bin.
double place_of(const Experiment& experiment, std::size_t option, double value) {
  if (experiment.sweep_is_grid) return value;
  const compare::SweptOption& swept = experiment.swept[option];
  const auto scaled = [&](double x) { return swept.is_log ? std::log(x) : x; };
  const double low = scaled(swept.range[0]), high = scaled(swept.range[1]);
  return std::clamp(std::floor(double(kBins) * (scaled(value) - low) / (high - low)), 0.0, double(kBins - 1));
}

/// The variants that share a place on a curve.
struct Group {
  std::vector<double> values;
  RowsOfVariant rows;
};

CurvePoint point_of(const Experiment& experiment, const Group& group, std::optional<std::size_t> metric) {
  CurvePoint point;
  for (const double value : group.values) point.value += value / double(group.values.size());
  point.of = group.rows.size();
  if (metric) {
    const FigureOfCases figure = figure_of_cases(group.rows, *metric);
    point.runs = figure.all.size();
    if (point.runs) point.middle = compare::summarise(figure.all).median;
    point.interval = figure.median_interval();
    return point;
  }
  compare::CaseRate rate;
  for (const compare::CellRow* row : group.rows) rate.add(row->case_name, row->is_success(experiment));
  point.runs = rate.runs();
  if (point.runs) point.middle = double(rate.successes()) / double(rate.runs());
  if (point.runs) point.interval = rate.interval();
  return point;
}

/// A case and a start.
using CellPlace = std::pair<std::size_t, std::size_t>;

/// Chooses places, each once, until there are enough.
class Chooser {
 public:
  explicit Chooser(std::size_t most) : most_(most) {}
  void add(const CellPlace& place) {
    if (places_.size() < most_ && taken_.insert(place).second) places_.push_back(place);
  }
  /// The first place of each list, then the second ones, and so on.
  void add_in_turn(const std::vector<std::vector<CellPlace>>& lists) {
    std::size_t longest = 0;
    for (const auto& list : lists) longest = std::max(longest, list.size());
    for (std::size_t i = 0; i < longest; ++i)
      for (const auto& list : lists)
        if (i < list.size()) add(list[i]);
  }
  const std::vector<CellPlace>& places() const { return places_; }

 private:
  std::size_t most_;
  std::vector<CellPlace> places_;
  std::set<CellPlace> taken_;
};

/// The rows without the first figure, the first one with each reason before all others.
std::vector<std::size_t> failed_rows(const std::vector<compare::CellRow>& rows) {
  std::vector<std::size_t> first, others;
  std::set<std::string> reasons;
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (!rows[i].values.at(0)) (reasons.insert(rows[i].failed + rows[i].absent).second ? first : others).push_back(i);
  first.insert(first.end(), others.begin(), others.end());
  return first;
}

}  // namespace

std::vector<Curve> curves_of(const Experiment& experiment, const std::vector<RowsOfVariant>& rows) {
  std::vector<std::string> bases;
  for (const compare::Variant& variant : experiment.variants)
    if (!contains(bases, variant.swept_from)) bases.push_back(variant.swept_from);
  std::vector<std::optional<std::size_t>> figures;
  for (std::size_t m = 0; m < experiment.metrics.size(); ++m) figures.emplace_back(m);
  if (experiment.defines_success()) figures.emplace_back();
  std::vector<Curve> curves;
  for (const std::string& base : bases)
    for (std::size_t option = 0; option < experiment.swept.size(); ++option) {
      std::map<double, Group> groups;
      for (std::size_t v = 0; v < rows.size(); ++v) {
        const compare::Variant& variant = experiment.variants[v];
        if (variant.swept_from != base) continue;
        Group& group = groups[place_of(experiment, option, variant.swept[option])];
        group.values.push_back(variant.swept[option]);
        group.rows.insert(group.rows.end(), rows[v].begin(), rows[v].end());
      }
      for (const auto& figure : figures) {
        curves.push_back({base, option, figure, {}});
        for (const auto& [place, group] : groups) curves.back().points.push_back(point_of(experiment, group, figure));
      }
    }
  return curves;
}

json curves_json(const Experiment& experiment, const std::vector<Curve>& curves) {
  json all = json::array();
  for (const Curve& curve : curves) {
    const compare::SweptOption& option = experiment.swept[curve.option];
    json points = json::array();
    for (const CurvePoint& point : curve.points) {
      points.push_back({{"value", point.value}, {"runs", point.runs}, {"of", point.of}});
      if (point.runs) points.back()["middle"] = point.middle;
      if (point.interval) points.back().update({{"low", point.interval->lower}, {"high", point.interval->upper}});
    }
    all.push_back({{"variant", curve.variant},
                   {"option", option.key},
                   {"scale", option.is_log ? "log" : "linear"},
                   {"figure", curve.metric ? experiment.metrics[*curve.metric].path : "success"},
                   {"points", points}});
  }
  return all;
}

std::vector<compare::CellIndex> cells_to_show(const compare::Experiment& experiment,
                                              const std::vector<compare::CellRow>& rows, std::size_t most) {
  const std::size_t variants = experiment.variants.size(), starts = experiment.starts.size();
  const auto place_of = [&](std::size_t row) { return CellPlace{row / variants / starts, row / variants % starts}; };
  std::vector<std::vector<std::size_t>> by_value(variants);  // for each variant, its rows with a value, the best first
  for (std::size_t i = 0; i < rows.size(); ++i)
    if (rows[i].values.at(0)) by_value[i % variants].push_back(i);
  for (auto& order : by_value)
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return experiment.metrics[0].higher_is_better() ? *rows[a].values[0] > *rows[b].values[0]
                                                      : *rows[a].values[0] < *rows[b].values[0];
    });

  const auto at_rank = [&](double rank) {
    std::vector<CellPlace> places;
    for (const auto& order : by_value)
      if (!order.empty()) places.push_back(place_of(order[std::size_t(std::lround(rank * double(order.size() - 1)))]));
    return places;
  };
  std::vector<CellPlace> failed;
  for (const std::size_t row : failed_rows(rows)) failed.push_back(place_of(row));
  Chooser chooser(most);
  chooser.add_in_turn({at_rank(1), at_rank(0.5), failed, at_rank(0)});  // worst, median, failed, best
  for (std::size_t i = 0; i < rows.size(); i += variants) chooser.add(place_of(i));

  std::vector<compare::CellIndex> cells;
  for (const auto& [case_index, start] : chooser.places())
    for (std::size_t v = 0; v < variants; ++v)
      if (rows[(case_index * starts + start) * variants + v].failed.empty()) cells.push_back({v, case_index, start});
  return cells;
}

}  // namespace marrow::cli
