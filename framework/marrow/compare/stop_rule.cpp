// SPDX-License-Identifier: Apache-2.0
#include "marrow/compare/stop_rule.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

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

/// A standard Brownian motion that is watched at some times, as long as it stays between bounds. At the time t it
/// stands for the test's sum, whose variance is t. So z is its place divided by sqrt(t).
class WatchedMotion {
 public:
  /// The bound z >= 0 that the motion exceeds on either side at `time`, for the first time, with the probability
  /// `chance`. From then on, only motions within this bound are watched.
  double bound_at(double time, double chance) {
    const double sd = std::sqrt(time - time_);
    double below = 0, above = kFarthest;
    while (above - below > 1e-10) {
      const double middle = 0.5 * (below + above);
      (chance_beyond(middle * std::sqrt(time), sd) > chance ? below : above) = middle;
    }
    const double bound = 0.5 * (below + above);
    move_to(time, std::min(bound, kFarthestPlace) * std::sqrt(time), sd);
    return bound;
  }

 private:
  static constexpr double kFarthest = 40;      // its tail is below the smallest double
  static constexpr double kFarthestPlace = 8;  // the sums end here; the probability beyond is 1e-15
  static constexpr std::size_t kPlaces = 301;  // odd, for Simpson's rule

  double chance_beyond(double place, double sd) const {
    if (places_.empty()) return 2 * upper_tail(place / sd);
    double chance = 0;
    for (std::size_t i = 0; i < kPlaces; ++i)
      chance += masses_[i] * (upper_tail((place - places_[i]) / sd) + upper_tail((place + places_[i]) / sd));
    return chance;
  }

  /// Simpson's rule: `masses` are densities times weights.
  void move_to(double time, double end, double sd) {
    std::vector<double> places(kPlaces), masses(kPlaces);
    const double step = 2 * end / double(kPlaces - 1);
    for (std::size_t i = 0; i < kPlaces; ++i) {
      places[i] = -end + step * double(i);
      const double weight = i == 0 || i == kPlaces - 1 ? 1 : i % 2 ? 4 : 2;
      masses[i] = weight * step / 3 * density(places[i], sd);
    }
    places_ = std::move(places);
    masses_ = std::move(masses);
    time_ = time;
  }

  double density(double place, double sd) const {
    const auto normal = [&](double x) {
      return std::exp(-0.5 * x * x / (sd * sd)) / (sd * std::sqrt(2 * std::numbers::pi));
    };
    if (places_.empty()) return normal(place);
    double sum = 0;
    for (std::size_t i = 0; i < kPlaces; ++i) sum += masses_[i] * normal(place - places_[i]);
    return sum;
  }

  double time_ = 0;
  std::vector<double> places_, masses_;  ///< of the motion at time_, where it is still watched
};

double spent(double share, double alpha, Spending spending) {
  if (share <= 0) return 0;
  if (spending == Spending::even) return alpha * std::log(1 + (std::numbers::e - 1) * share);
  return 4 * upper_tail(z_of_tail(alpha / 4) / std::sqrt(share));
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

std::vector<double> levels_of_looks(const std::vector<double>& information, double alpha, Spending spending) {
  if (!(alpha >= 0.001 && alpha <= 0.5))
    throw Error(formatted("alpha is {:f}; give a fraction from 0.001 to 0.5, such as 0.05", alpha));
  if (information.empty()) throw Error("there are no looks; give at least one");
  WatchedMotion motion;
  std::vector<double> levels;
  double before = 0;
  for (const double share : information) {
    if (!(share > before && share <= 1))
      throw Error(formatted(
          "look {} has seen the share {:f} of the cases; expected more than at the look before, and at most 1",
          levels.size() + 1, share));
    const double chance = spent(share, alpha, spending) - spent(before, alpha, spending);
    levels.push_back(2 * upper_tail(motion.bound_at(share, chance)));
    before = share;
  }
  return levels;
}

std::vector<std::size_t> looks_at(std::size_t first, std::size_t every, std::size_t most) {
  if (!first || !every || most < first)
    throw Error(
        formatted("looks begin at {} cases and end at {}, one every {}; expected at least 1 for each, and an end not "
                  "before the beginning",
                  first, most, every));
  std::vector<std::size_t> looks;
  for (std::size_t cases = first; cases < most; cases += every) looks.push_back(cases);
  looks.push_back(most);
  return looks;
}

}  // namespace marrow::compare
