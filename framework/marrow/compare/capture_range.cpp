// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/compare/case_rate.hpp"
#include "marrow/compare/statistics.hpp"

namespace marrow::compare {
namespace {

constexpr std::size_t kMostBins = 100;  // the last one holds all starts that are farther

}  // namespace

CaptureRange capture_range(const std::vector<StartOutcome>& outcomes, double bin_width, double least_rate) {
  if (!(bin_width > 0)) throw Error(formatted("the width of a bin is {:f}; give a positive one", bin_width));
  if (!(least_rate >= 0 && least_rate <= 1))
    throw Error(formatted("the success rate is {:f}; give a fraction from 0 to 1, such as 0.95", least_rate));
  CaptureRange capture;
  std::vector<CaseRate> rates;
  double farthest = 0;
  for (const StartOutcome& outcome : outcomes) {
    if (!(outcome.error >= 0 && std::isfinite(outcome.error)))
      throw Error(
          formatted("the error of a start is {:f}, which is no distance; leave runs out whose start is not known",
                    outcome.error));
    farthest = std::max(farthest, outcome.error);
    const std::size_t bin = std::size_t(std::min(outcome.error / bin_width, double(kMostBins - 1)));
    while (capture.bins.size() <= bin) {
      const double from = bin_width * double(capture.bins.size());
      capture.bins.push_back({from, from + bin_width, 0, 0, {0, 1, 0.95}});
    }
    rates.resize(capture.bins.size());
    const std::size_t number = std::size_t(&outcome - outcomes.data());
    rates[bin].add(outcome.case_name.empty() ? formatted(" {}", number) : outcome.case_name, outcome.success);
  }
  if (!capture.bins.empty()) capture.bins.back().to = std::max(capture.bins.back().to, farthest);
  capture.is_open = !outcomes.empty();
  for (std::size_t b = 0; b < capture.bins.size(); ++b) {
    CaptureRange::Bin& bin = capture.bins[b];
    bin.runs = rates[b].runs();
    bin.successes = rates[b].successes();
    if (!bin.runs) continue;
    bin.success = rates[b].interval();
    capture.is_open = capture.is_open && double(bin.successes) >= least_rate * double(bin.runs);
    if (capture.is_open) capture.range = bin.to;
  }
  if (capture.is_open) capture.range = farthest;
  return capture;
}

}  // namespace marrow::compare
