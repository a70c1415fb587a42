// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/paired.hpp"

namespace marrow::compare {
namespace {

bool shows_zero(const std::string& number) { return number.find_first_of("123456789") == std::string::npos; }

/// The number of decimals with which one unit of the last place is at most `largest_unit`.
int decimals_for(double largest_unit) {
  int decimals = 0;
  for (double unit = 1; decimals < 15 && unit > largest_unit * (1 + 1e-9); unit /= 10) ++decimals;
  return decimals;
}

/// p with two digits, or with more if rounding would move it across alpha. It is never shown as 0.
std::string p_text(double p, double alpha) {
  if (p < 0.001) return "p < 0.001";
  if (p >= 0.995) return "p = 1";
  int decimals = p >= 0.0995 ? 2 : p >= 0.00995 ? 3 : 4;
  const auto shown = [&] { return parsed_number(fixed_number(p, decimals)).value(); };
  while (decimals < 6 && p != alpha && (shown() == alpha || (shown() < alpha) != (p < alpha))) ++decimals;
  return "p = " + fixed_number(p, decimals);
}

/// The width that decides how many decimals are shown: that of the interval, or twice that of its finite side. Nothing
/// if both sides are infinite.
std::optional<double> width_of(double difference, const Interval& interval) {
  if (std::isinf(difference)) return std::nullopt;
  const double below = difference - interval.lower, above = interval.upper - difference;
  if (std::isfinite(below) && std::isfinite(above)) return interval.upper - interval.lower;
  if (std::isfinite(below)) return 2 * below;
  if (std::isfinite(above)) return 2 * above;
  return std::nullopt;
}

/// A bound near 0 gets up to two more decimals: rounded to 0, it would read as no difference.
int decimals_of(double difference, const Interval& interval) {
  const std::optional<double> width = width_of(difference, interval);
  if (!width || *width <= 1e-9 * std::abs(difference)) {  // no wider than numbers are rounded
    for (const double value : {difference, interval.lower, interval.upper})
      if (std::isfinite(value)) return value == 0 ? 0 : decimals_for(std::abs(value) / 10);
    return 0;
  }
  const int decimals = decimals_for(*width / 4);
  const bool without_zero = interval.lower > 0 || interval.upper < 0;
  if (!without_zero) return decimals;
  const double nearest = std::min(std::abs(interval.lower), std::abs(interval.upper));
  return std::max(decimals, std::min(decimals_for(nearest), decimals + 2));
}

/// What a sentence calls the two.
struct Names {
  std::string variant, reference;
};

/// A comparison in the direction that its sentence names: there, the difference is positive.
struct Directed {
  const Names& names;
  const Metric& metric;
  double difference = 0;
  Interval interval;
  bool is_worse = false;  ///< the direction

  Directed(const Names& of_both, const Metric& of, double from, const Interval& within)
      : names(of_both), metric(of), difference(from), interval(within), is_worse((from >= 0) != of.larger_is_better) {
    if (from >= 0) return;
    difference = -from;
    interval = {-within.upper, -within.lower, within.confidence};
  }

  /// "0.03 mm worse", also of a value to the other side, which is "0.03 mm better". 0 is neither.
  std::string amount_of(double value, int decimals) const {
    const std::string number = fixed_number(std::abs(value), decimals);
    const std::string text = number + (metric.unit.empty() ? "" : " " + metric.unit);
    return shows_zero(number) ? text : text + ((value > 0) == is_worse ? " worse" : " better");
  }
  std::string amount(int decimals) const { return amount_of(difference, decimals); }

  /// Both bounds have the direction of the difference, so they are numbers only.
  bool says_direction(int decimals) const {
    return interval.lower >= 0 && std::isfinite(difference) && !shows_zero(fixed_number(difference, decimals));
  }
  std::string bound(double value, int decimals) const {
    if (std::isinf(value)) return "a failure of " + ((value > 0) == is_worse ? names.variant : names.reference);
    if (!says_direction(decimals)) return amount_of(value, decimals);
    const bool has_failure = std::isinf(interval.lower) || std::isinf(interval.upper);
    return fixed_number(std::abs(value), decimals) + (has_failure && !metric.unit.empty() ? " " + metric.unit : "");
  }
  std::string range(int decimals) const {
    return short_number(100 * interval.confidence, 6) + " % interval " + bound(interval.lower, decimals) + " to " +
           bound(interval.upper, decimals);
  }
};

/// How many runs of whom failed; empty if none did.
std::string failures_text(const Names& names, const Tally& runs) {
  if (runs.all() == runs.both) return "";
  return formatted("; of {}, only {} failed in {}, only {} in {}, both in {}", counted(runs.all(), "run"),
                   names.variant, runs.variant_lost, names.reference, runs.reference_lost, runs.neither);
}

/// The beginning of a sentence whose median is a failure: who fails more often, and in how many cases.
std::string more_failures(const Names& names, const Comparison& comparison, bool variant_fails) {
  return formatted(
      "{}{} of {}",
      variant_fails ? "fails more often than " + names.reference + ", in " : names.reference + " fails more often, in ",
      variant_fails ? comparison.cases.variant_lost : comparison.cases.reference_lost,
      counted(comparison.compared(), "case"));
}

std::string of_both(const Names& names, const Metric& metric, const Comparison& comparison) {
  if (!comparison.median_of_both) return "";
  const Directed directed(names, metric, *comparison.median_of_both, {});
  const int decimals = directed.difference == 0 ? 0 : decimals_for(directed.difference / 10);
  return "; where both have a value, in " + counted(comparison.cases_of_both, "case") + ", the median is " +
         directed.amount(decimals);
}

/// Why no difference can be shown, or is shown although p < alpha; else empty.
std::string doubts(const Comparison& comparison, const CorrectedP& corrected, double alpha, bool has_interval,
                   bool is_shown) {
  const std::size_t fewest = fewest_cases(alpha, corrected.comparisons);
  if (!is_shown && comparison.compared() < fewest)
    return formatted("; fewer than {} cases cannot reach p < {}{}{}", fewest, short_number(alpha, 6),
                     corrected.comparisons > 1 ? formatted(" with {} comparisons", corrected.comparisons) : "",
                     has_interval ? "" : ", and no interval is given");
  if (is_shown || corrected.p >= alpha) return "";
  const bool contains_zero = comparison.interval.lower <= 0 && comparison.interval.upper >= 0;
  return std::string(contains_zero ? "; the interval contains 0" : "; the ranks and the median do not agree") +
         ", look at the single cases";
}

/// What was found, from "0.12 mm worse" to "20 of 22 cases".
std::string found_text(const Comparison& comparison, const Directed& directed, bool has_interval) {
  const Interval& interval = directed.interval;
  const bool is_failure = std::isinf(directed.difference);
  const int decimals = decimals_of(directed.difference, has_interval ? interval : Interval{-kInfinite, kInfinite});
  std::string text =
      is_failure ? more_failures(directed.names, comparison, directed.is_worse) : directed.amount(decimals);
  if (has_interval && interval.lower < kInfinite) text += ", " + directed.range(decimals);
  if (!is_failure || comparison.cases.neither)
    text += ", " + (comparison.cases.neither ? formatted("{} of ", comparison.compared()) : std::string()) +
            counted(comparison.cases.all(), "case");
  return text;
}

bool has_interval(const Comparison& comparison) {
  return comparison.compared() >= fewest_cases(1 - comparison.interval.confidence);
}

/// The whole sentence after its beginning. `p` is what it says of p, if anything.
std::string said(const std::string& begin, const Names& names, const Metric& metric, const Comparison& comparison,
                 const std::string& verb, const std::string& p) {
  const std::string text = metric.label.empty() ? begin : begin + ", " + metric.label;
  if (!comparison.compared()) return text + ": no case can be compared" + failures_text(names, comparison.runs);
  const Directed directed(names, metric, comparison.median_difference, comparison.interval);
  const bool is_given = has_interval(comparison);
  return text + verb + found_text(comparison, directed, is_given) + p + failures_text(names, comparison.runs) +
         (std::isinf(directed.difference) ? of_both(names, metric, comparison) : "");
}

}  // namespace

std::size_t fewest_cases(double alpha, std::size_t comparisons) {
  if (!(alpha > 0 && alpha < 1))
    throw Error(formatted("alpha is {:.6g}; give a fraction between 0 and 1, such as 0.05", alpha));
  if (!comparisons) throw Error("there are no comparisons; give at least one");
  std::size_t cases = 1;
  for (double least_p = double(comparisons); least_p >= alpha; least_p /= 2) ++cases;
  return cases;
}

bool difference_shown(const Comparison& comparison, double p_after_holm, double alpha) {
  if (!(p_after_holm >= 0 && p_after_holm <= 1))
    throw Error(formatted("p is {:.6g}; expected a number from 0 to 1", p_after_holm));
  if (p_after_holm >= alpha) return false;
  const bool ranks_positive = comparison.test.positive_ranks > comparison.test.negative_ranks;
  if (comparison.side_of_failures == (ranks_positive ? 1 : -1)) return true;
  return ranks_positive ? comparison.interval.lower > 0 : comparison.interval.upper < 0;
}

std::string sentence(const std::string& variant, const Metric& metric, const Comparison& comparison,
                     const CorrectedP& corrected, double alpha, const std::string& reference) {
  const bool is_shown = difference_shown(comparison, corrected.p, alpha);
  const Names names{variant, reference.empty() ? "the baseline" : reference};
  const std::string text =
      said(reference.empty() ? variant : variant + " against " + reference, names, metric, comparison,
           is_shown ? ": " : ": no difference shown: ", ", " + p_text(corrected.p, alpha));
  if (!comparison.compared()) return text;
  return text + doubts(comparison, corrected, alpha, has_interval(comparison), is_shown);
}

std::string effect_sentence(const std::string& variant, const std::string& reference, const Metric& metric,
                            const Comparison& comparison) {
  return said(variant + " against " + reference, {variant, reference}, metric, comparison, ": ", "");
}

}  // namespace marrow::compare
