// SPDX-License-Identifier: Apache-2.0
// Response curves: how a figure depends on an option that an experiment sweeps.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

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

}  // namespace marrow::cli
