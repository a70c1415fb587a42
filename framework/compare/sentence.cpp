// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cmath>

#include "marrow/compare/statistics.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::compare {
namespace {

bool shows_zero(const std::string& number) { return number.find_first_of("123456789") == std::string::npos; }

/// The number with a decimal point in every locale, and without a minus sign before zero.
std::string fixed(double value, int decimals) {
  char text[400];  // the largest double has 309 digits before the point
  const auto end = std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, decimals).ptr;
  const std::string result(text, end);
  return result[0] == '-' && shows_zero(result) ? result.substr(1) : result;
}

/// A number with as few digits as it needs: "95", "99.9", "0.05".
std::string plain(double value) {
  char text[40];
  return {text, std::to_chars(text, text + sizeof text, value, std::chars_format::general, 6).ptr};
}

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
  const auto shown = [&] {
    const std::string text = fixed(p, decimals);
    double value = 0;
    std::from_chars(text.data(), text.data() + text.size(), value);
    return value;
  };
  while (decimals < 6 && p != alpha && (shown() == alpha || (shown() < alpha) != (p < alpha))) ++decimals;
  return "p = " + fixed(p, decimals);
}

/// The number of decimals follows from the interval's width; without an interval, from the difference. A bound near 0
/// must not be rounded to 0, because this would read as no difference. Up to two more decimals are used to avoid it.
int decimals_of(double difference, const Interval& interval, bool with_interval) {
  const double width = interval.upper - interval.lower;
  if (!with_interval || width <= 1e-9 * std::abs(difference))  // no wider than numbers are rounded
    return difference == 0 ? 0 : decimals_for(std::abs(difference) / 10);
  const int decimals = decimals_for(width / 4);
  const bool without_zero = interval.lower > 0 || interval.upper < 0;
  if (!without_zero) return decimals;
  const double nearest = std::min(std::abs(interval.lower), std::abs(interval.upper));
  return std::max(decimals, std::min(decimals_for(nearest), decimals + 2));
}

}  // namespace

std::size_t fewest_cases(double alpha) {
  if (!(alpha >= 0.001 && alpha < 1))
    throw Error("alpha is " + plain(alpha) + "; give a fraction from 0.001 to below 1, such as 0.05");
  std::size_t cases = 1;
  for (double least_p = 1; least_p >= alpha; least_p /= 2) ++cases;
  return cases;
}

bool difference_shown(const Comparison& comparison, double p_after_holm, double alpha) {
  if (!(p_after_holm >= 0 && p_after_holm <= 1))
    throw Error("p is " + plain(p_after_holm) + "; expected a number from 0 to 1");
  if (comparison.cases < fewest_cases(alpha) || p_after_holm >= alpha) return false;
  const bool ranks_positive = comparison.test.positive_ranks > comparison.test.negative_ranks;
  return ranks_positive ? comparison.interval.lower > 0 : comparison.interval.upper < 0;
}

std::string sentence(const std::string& variant, const Metric& metric, const Comparison& comparison,
                     double p_after_holm, double alpha) {
  const bool shown = difference_shown(comparison, p_after_holm, alpha);
  const std::size_t fewest = fewest_cases(alpha);
  const bool enough = comparison.cases >= fewest;
  // From here on, all numbers are in the direction that the sentence names.
  const double difference = comparison.median_difference;
  const double sign = difference < 0 ? -1 : 1;
  const bool worse = (sign > 0) != metric.larger_is_better;
  Interval interval = comparison.interval;
  if (sign < 0) interval = {-interval.upper, -interval.lower, interval.confidence};

  const int decimals = decimals_of(difference, interval, enough);
  const std::string percent = plain(100 * interval.confidence) + " %";
  std::string text = metric.label.empty() ? variant : variant + ", " + metric.label;
  text += shown ? ": " : ": no difference shown: ";
  const std::string amount = fixed(sign * difference, decimals);
  text += amount + (metric.unit.empty() ? "" : " " + metric.unit);
  if (!shows_zero(amount)) text += worse ? " worse" : " better";
  if (enough) {
    text += ", " + percent + " interval " + fixed(interval.lower, decimals) + " to " + fixed(interval.upper, decimals);
    if (shows_zero(amount)) text += worse ? " (positive is worse)" : " (positive is better)";
  }
  text += ", " + std::to_string(comparison.cases) + (comparison.cases == 1 ? " case, " : " cases, ");
  text += p_text(p_after_holm, alpha);
  if (!enough)
    text += "; fewer than " + std::to_string(fewest) + " cases cannot reach p < " + plain(alpha) +
            ", and no interval is given";
  else if (!shown && p_after_holm < alpha)
    text += "; the ranks and the median do not agree, look at the single cases";
  return text;
}

}  // namespace marrow::compare
