// SPDX-License-Identifier: Apache-2.0
// Reads one computation per line from standard input and prints its numbers on one line, for scipy_test.py.
#include <cstdio>
#include <iostream>
#include <marrow/compare/statistics.hpp>
#include <marrow/domain/error.hpp>
#include <sstream>

using namespace marrow::compare;

namespace {

std::vector<double> answer(std::istringstream& line) {
  std::string command;
  line >> command;
  double first = 0, second = 0;
  const bool two_settings = command == "wilson" || command == "median_interval";
  if (two_settings) line >> first >> second;
  std::vector<double> values;
  for (double value; line >> value;) values.push_back(value);

  if (command == "wilson") {
    const Interval interval =
        wilson_interval(static_cast<std::size_t>(first), static_cast<std::size_t>(second), values.at(0));
    return {interval.lower, interval.upper};
  }
  if (command == "median_interval") {
    const Interval interval = median_interval(values, static_cast<std::uint64_t>(first), second);
    return {interval.lower, interval.upper};
  }
  if (command == "summary") {
    const Summary summary = summarise(values);
    return {static_cast<double>(summary.count),
            summary.mean,
            summary.median,
            summary.lower_quartile,
            summary.upper_quartile,
            summary.percentile_95,
            summary.worst};
  }
  if (command == "holm") return holm(values);
  const SignedRankMethod method = command == "exact"    ? SignedRankMethod::exact
                                  : command == "normal" ? SignedRankMethod::normal
                                                        : SignedRankMethod::automatic;
  const SignedRank test = signed_rank_test(values, method);
  return {test.positive_ranks, test.negative_ranks, test.p, test.exact ? 1.0 : 0.0};
}

}  // namespace

int main() {
  for (std::string text; std::getline(std::cin, text);) {
    std::istringstream line(text);
    try {
      for (const double value : answer(line)) std::printf("%.17g ", value);
    } catch (const marrow::Error& error) {
      std::printf("error: %s", error.what());
    }
    std::printf("\n");
  }
}
