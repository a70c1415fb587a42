// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/stop_rule.hpp"

#include <algorithm>
#include <cmath>

#include "distributions.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/sequential.hpp"

namespace marrow::compare {
namespace {

Look begin_look(const StopPlan& plan, std::size_t cases) {
  Look look;
  look.level = plan.level_at(cases);
  look.number = plan.number_of(cases) + 1;
  look.looks = plan.looks().size();
  look.cases = cases;
  look.variant = plan.rule().variant;
  look.interval = {-kInfinite, kInfinite, 1 - look.level};
  return look;
}

/// What follows from the look.
std::string end(const StopRule& rule, const Look& look) {
  if (look.is_met) return "; the rule says stop";
  if (look.is_last()) return "; this was the last look";
  return formatted("; --more-cases goes on, with {} cases a look", rule.look_every);
}

/// A number, or the failure that an infinite one stands for.
std::string value_text(double value) { return std::isfinite(value) ? short_number(value) : "a failure"; }

std::string holds(const StopRule& rule) {
  return formatted(", which holds with {:.3g} % confidence over all looks", 100 * (1 - rule.alpha));
}

/// The interval, and its confidence over all looks.
std::string meaning(const StopRule& rule, const Look& look, const std::string& unit) {
  const bool ends_in_failure = std::isinf(look.interval.upper);
  return value_text(look.interval.lower) + (ends_in_failure && std::isfinite(look.interval.lower) ? unit : "") +
         " to " + value_text(look.interval.upper) + (ends_in_failure ? "" : unit) + holds(rule);
}

std::string text_of_width(const StopRule& rule, const Look& look, const LookNames& names, const std::string& unit) {
  const std::string interval = "interval of " + names.figure;
  if (!std::isfinite(look.width())) return names.variant + ": too few cases for an " + interval + end(rule, look);
  return formatted("the widest {} is {:.3g}{} wide, {}{:.3g}{}{}. It is {}'s, {}", interval, look.width(), unit,
                   look.is_met ? "not more than " : "more than ", rule.width, unit, end(rule, look), names.variant,
                   meaning(rule, look, unit));
}

/// Why a difference is not shown although p is below the level; else empty.
std::string doubt(const Look& look) {
  if (look.is_met || look.p >= look.level) return "";
  const bool contains_zero = look.interval.lower <= 0 && look.interval.upper >= 0;
  return contains_zero ? ", but the interval contains 0" : ", but the ranks and the median do not agree";
}

std::string text_of_difference(const StopRule& rule, const Look& look, const LookNames& names,
                               const std::string& unit) {
  const std::string text =
      formatted("{}{}{} in {}: p = {:.3g}{}{:.3g}{}{}", names.variant,
                look.is_met ? " differs from " : " is not shown to differ from ", names.baseline, names.figure, look.p,
                look.p < look.level ? ", below " : ", not below ", look.level, doubt(look), end(rule, look));
  if (std::isinf(look.interval.lower) && look.interval.upper == -look.interval.lower) return text;  // too few cases
  if (std::isinf(look.interval.lower) && look.interval.upper == look.interval.lower)
    return text + ". The median difference is a failure" + holds(rule);
  return text + ". The median difference is " + value_text(look.difference) +
         (std::isfinite(look.difference) ? unit : "") + ", within " + meaning(rule, look, unit);
}

}  // namespace

std::vector<std::size_t> StopRule::looks() const { return looks_at(first_cases, look_every, most_cases); }

StopPlan::StopPlan(const StopRule& rule) : rule_(rule), looks_(rule.looks()) {
  std::vector<double> shares;
  for (const std::size_t cases : looks_) shares.push_back(double(cases) / double(rule.most_cases));
  levels_ = levels_of_looks(shares, rule.alpha, rule.goal == StopRule::Goal::width ? Spending::even : Spending::late);
}

std::size_t StopPlan::number_of(std::size_t cases) const {
  const auto found = std::find(looks_.begin(), looks_.end(), cases);
  if (found == looks_.end()) throw Error(formatted("the rule has no look at {} cases", cases));
  return std::size_t(found - looks_.begin());
}

Look look_at_widths(const StopPlan& plan, std::size_t cases, const std::vector<std::optional<Interval>>& intervals) {
  Look look = begin_look(plan, cases);
  if (intervals.empty()) throw Error("there are no variants to look at; give at least one");
  double widest = -1;
  for (std::size_t v = 0; v < intervals.size(); ++v) {
    const double width = intervals[v] ? intervals[v]->upper - intervals[v]->lower : kInfinite;
    if (width <= widest) continue;
    widest = width;
    look.variant = v;
    look.interval = intervals[v].value_or(Interval{-kInfinite, kInfinite, 1 - look.level});
  }
  look.is_met = widest <= plan.rule().width;
  return look;
}

Look look_at_difference(const StopPlan& plan, std::size_t cases, const std::vector<Pair>& pairs,
                        bool larger_is_better) {
  Look look = begin_look(plan, cases);
  if (look.level <= 0) return look;
  const Comparison comparison = compare_pairs(pairs, larger_is_better, 1 - look.level);
  look.p = comparison.test.p;
  look.is_met = difference_shown(comparison, look.p, look.level);
  look.difference = comparison.median_difference;
  look.interval = comparison.interval;
  return look;
}

std::string sentence(const StopRule& rule, const Look& look, const LookNames& names) {
  const std::string unit = names.unit.empty() ? "" : " " + names.unit;
  return formatted("look {} of {}, {} cases: {}", look.number, look.looks, look.cases,
                   rule.goal == StopRule::Goal::width ? text_of_width(rule, look, names, unit)
                                                      : text_of_difference(rule, look, names, unit));
}

}  // namespace marrow::compare
