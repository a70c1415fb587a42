// SPDX-License-Identifier: Apache-2.0
// A verdict made of a number, by which the tests see what marrow does with verdicts.
#include <marrow/plugin.hpp>

namespace {

using marrow::Judgement, marrow::Metrics, marrow::Verdict;

struct Options {
  double doubtful_above = 5;
  double wrong_above = 50;
  std::string remedy = "a third view";
};

Verdict verdict(const Metrics& percent, const Options& options) {
  const double value = percent.items.at(0).value;
  Verdict verdict;
  if (value >= 0) verdict.failure_probability = value / 100;
  verdict.judgement = value > options.wrong_above                   ? Judgement::wrong
                      : value > options.doubtful_above || value < 0 ? Judgement::doubtful
                                                                    : Judgement::trusted;
  verdict.reasons = {"the number is " + std::to_string(int(value)), "it was given so"};
  if (verdict.judgement != Judgement::trusted) verdict.remedies = {options.remedy};
  verdict.figures = {{"number", value, "%"}};
  return verdict;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("test.verdict", verdict)
      .summary("A verdict on a number")
      .in("percent", "probability of a failure; less than 0 is not known")
      .out("verdict", "the verdict")
      .option("doubtful_above", &Options::doubtful_above, "doubtful above this number")
      .option("wrong_above", &Options::wrong_above, "wrong above this number")
      .option("remedy", &Options::remedy, "what would settle it");
}
