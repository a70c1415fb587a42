// SPDX-License-Identifier: Apache-2.0
// Reads one computation per line from standard input and prints its numbers on one line, for scipy_test.py.
#include <cstdio>
#include <iostream>
#include <marrow/base/error.hpp>
#include <marrow/compare/bootstrap.hpp>
#include <marrow/compare/case_rate.hpp>
#include <marrow/compare/paired.hpp>
#include <sstream>

using namespace marrow::compare;

namespace {

std::vector<double> answer(std::istringstream& line) {
  std::string command;
  line >> command;
  double first = 0, second = 0;
  if (command == "order_statistics") line >> first;
  if (command == "wilson" || command == "median_of_runs" || command == "exact_rate") line >> first >> second;
  std::vector<double> values;
  for (double value; line >> value;) values.push_back(value);

  if (command == "wilson") {
    const Interval interval =
        wilson_interval(static_cast<std::size_t>(first), static_cast<std::size_t>(second), values.at(0));
    return {interval.lower, interval.upper};
  }
  if (command == "order_statistics") {
    const Interval interval = order_statistic_interval(values, first);
    return {interval.lower, interval.upper};
  }
  if (command == "median_of_runs") {  // cases of equally many runs, one after the other
    const auto runs = static_cast<std::ptrdiff_t>(first);
    ValuesOfCases cases;
    for (auto from = values.begin(); from < values.end(); from += runs) cases.emplace_back(from, from + runs);
    const Interval interval = median_of_runs_interval(cases, {1, second});
    return {interval.lower, interval.upper};
  }
  if (command == "exact_rate") {  // one run in each case
    CaseRate rate;
    for (std::size_t run = 0; run < static_cast<std::size_t>(second); ++run)
      rate.add(std::to_string(run), run < static_cast<std::size_t>(first));
    const Interval interval = rate.exact_interval(values.at(0));
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
