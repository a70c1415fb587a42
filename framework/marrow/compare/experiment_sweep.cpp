// SPDX-License-Identifier: Apache-2.0
#include "experiment_sections.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "draw.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::compare {
namespace {

constexpr const char* kSweepExample = "write it as  sweep: {options: {edges.high: [60, 90]}, grid: 5}";

/// The fractions of all combinations of `count` values of each option. The last option changes fastest.
std::vector<std::vector<double>> grid_of(std::size_t options, std::size_t count) {
  std::vector<std::vector<double>> all{{}};
  for (std::size_t o = 0; o < options; ++o) {
    std::vector<std::vector<double>> next;
    for (const std::vector<double>& point : all)
      for (std::size_t i = 0; i < count; ++i) {
        next.push_back(point);
        next.back().push_back(double(i) / double(count - 1));
      }
    all = std::move(next);
  }
  return all;
}

void read_ends(StrictYaml& yaml, const YAML::Node& node, const Place& place, SweptOption& option) {
  option.range = {1, 2};
  if (!node.IsSequence() || node.size() != 2)
    return yaml.fault(place, "'" + option.key + "' must have a range of two ends",
                      "write it as  " + option.key + ": [60, 90]");
  for (std::size_t i = 0; i < 2; ++i)
    option.range[i] = yaml.number(node[i], yaml.place(node[i]), option.key).value_or(option.range[i]);
  if (!(option.range[0] < option.range[1]) || !std::isfinite(option.range[1] - option.range[0]))
    yaml.fault(place, formatted("the range of '{}' must end above its beginning, got {:.6g} to {:.6g}", option.key,
                                option.range[0], option.range[1]));
}

/// Rounded to a power of ten that is at most a thousandth of `range`.
double rounded(double value, double range) {
  const double step = std::pow(10, std::floor(std::log10(range / 1000)));
  return parsed_number(formatted("{:.15g}", std::round(value / step) * step)).value();
}

}  // namespace

SweptOption swept_option_of(StrictYaml& yaml, const YamlEntry& entry) {
  static const std::vector<std::string> kKeys{"range", "scale", "whole"};
  SweptOption option;
  option.key = entry.key;
  option.place = entry.place;
  if (entry.value.IsMap()) {
    bool has_range = false;
    for (const YamlEntry& part : yaml.map(entry.value, entry.place, "'" + entry.key + "'", &kKeys)) {
      has_range |= part.key == "range";
      if (part.key == "range") read_ends(yaml, part.value, part.place, option);
      if (part.key == "whole") option.is_whole = yaml.boolean(part.value, part.place, "whole").value_or(false);
      if (part.key != "scale") continue;
      const std::string scale = yaml.text(part.value, part.place, "scale").value_or("linear");
      option.is_log = scale == "log";
      if (scale != "log" && scale != "linear")
        yaml.fault(part.place, "'" + scale + "' is no scale", suggestion(scale, {"linear", "log"}));
    }
    if (!has_range) yaml.fault(entry.place, "'" + entry.key + "' has no range", "add  range: [60, 90]");
  } else {
    read_ends(yaml, entry.value, entry.place, option);
  }
  if (option.is_log && !(option.range[0] > 0))
    yaml.fault(entry.place, "a range with a log scale must begin above 0, got " + short_number(option.range[0], 6));
  return option;
}

void SweepReader::read(const YamlEntry& section) {
  static const std::vector<std::string> kKeys{"options", "grid", "sobol"};
  place_ = section.place;
  for (const YamlEntry& entry : yaml_.map(section.value, section.place, "'sweep'", &kKeys)) {
    if (entry.key == "grid") grid_ = count_of(yaml_, entry, 2, kMostVariants);
    if (entry.key == "sobol") sobol_ = count_of(yaml_, entry, 2, kMostVariants);
    if (entry.key == "options")
      for (const YamlEntry& option : yaml_.map(entry.value, entry.place, "'options'"))
        options_.push_back(swept_option_of(yaml_, option));
  }
  if (section.value.IsMap()) check(section);
}

void SweepReader::check(const YamlEntry& section) {
  if (options_.empty()) return yaml_.fault(section.place, "'sweep' names no option", kSweepExample);
  if (!grid_ == !sobol_)
    return yaml_.fault(section.place,
                       "'sweep' must say either how fine its grid is or how many of Sobol's points it takes",
                       "add  grid: 5  for 5 values of each option, or  sobol: 32");
  if (options_.size() > kMostSobolDimensions)
    return yaml_.fault(section.place, formatted("'sweep' has {} options, at most {} are possible", options_.size(),
                                                kMostSobolDimensions));
  if (grid_ && std::pow(double(grid_), double(options_.size())) > double(kMostVariants))
    return yaml_.fault(
        section.place,
        formatted("a grid of {} values of {} options makes more than the {} variants that can be compared", grid_,
                  options_.size(), kMostVariants),
        "take fewer values, or Sobol's points, as  sobol: 64");
  is_good_ = true;
}

std::vector<std::vector<double>> SweepReader::points() const {
  std::vector<std::vector<double>> points;
  if (grid_) points = grid_of(options_.size(), grid_);
  for (std::size_t i = 0; i < sobol_; ++i) {
    const auto point = sobol_point(i);
    points.emplace_back(point.begin(), point.begin() + std::ptrdiff_t(options_.size()));
  }
  std::set<std::vector<double>> known;
  std::vector<std::vector<double>> values;
  for (std::vector<double>& point : points) {
    for (std::size_t o = 0; o < options_.size(); ++o) point[o] = options_[o].value_at(point[o]);
    if (known.insert(point).second) values.push_back(std::move(point));  // whole numbers may be equal
  }
  return values;
}

void SweepReader::apply(Experiment& experiment) {
  if (!is_good_) return;
  const std::vector<std::vector<double>> all = points();
  std::vector<Variant> before = std::move(experiment.variants), after;
  if (before.empty()) before.push_back({"", place_, {}});
  if (before.size() * all.size() > kMostVariants) {
    yaml_.fault(place_,
                formatted("{} variants at {} points are {}, at most {} can be compared", before.size(), all.size(),
                          before.size() * all.size(), kMostVariants),
                "take fewer points");
    return;
  }
  std::set<std::string> names;
  for (const Variant& variant : before)
    for (const std::vector<double>& point : all) {
      Variant more = variant;
      more.swept = point;
      more.swept_from = variant.name;
      for (std::size_t o = 0; o < options_.size(); ++o) {
        if (!more.name.empty()) more.name += '+';
        more.name += short_number(point[o], 6);
        more.overrides.push_back({options_[o].key, exact_number(point[o]), options_[o].place});
      }
      if (!check_name(yaml_, more.name, variant.place, "a variant's name")) return;
      if (!names.insert(in_small_letters(more.name)).second)
        return yaml_.fault(place_, "two points of the sweep are written alike, as '" + more.name + "'",
                           "take a wider range, or fewer points");
      after.push_back(std::move(more));
    }
  experiment.variants = std::move(after);
  experiment.swept = options_;
  experiment.sweep_is_grid = grid_ > 0;
}

double SweptOption::value_at(double fraction) const {
  const auto& [low, high] = range;
  const double value = is_log ? low * std::pow(high / low, fraction) : low + (high - low) * fraction;
  return is_whole ? std::round(value) : value;
}

double SweptOption::fraction_of(double value) const {
  const auto& [low, high] = range;
  if (is_log && !(value > 0)) return 0;
  const double fraction = is_log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(fraction, 0.0, 1.0);
}

std::vector<double> TuneRule::values_at(const std::vector<double>& fractions) const {
  std::vector<double> values;
  for (std::size_t o = 0; o < options.size(); ++o) {
    const SweptOption& option = options[o];
    const double value = option.value_at(std::clamp(fractions[o], 0.0, 1.0));
    const double near = option.is_log ? value : option.range[1] - option.range[0];
    values.push_back(std::clamp(rounded(value, near), option.range[0], option.range[1]));
  }
  return values;
}

}  // namespace marrow::compare
