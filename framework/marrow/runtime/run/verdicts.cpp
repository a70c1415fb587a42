// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/verdicts.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/runtime/run/output_items.hpp"

namespace marrow {

std::vector<NamedVerdict> verdicts_of(const Pipeline& pipeline, const RunResult& result) {
  std::vector<NamedVerdict> verdicts;
  for_each_item(pipeline, result, TypeInfo::of<Verdict>(),
                [&](const std::string& output, const std::string& item, const Value& value) {
                  verdicts.push_back({output, item, value.as<Verdict>()});
                });
  return verdicts;
}

Verdict worst_of(const std::vector<NamedVerdict>& verdicts) {
  Verdict worst;
  worst.judgement = Judgement::trusted;
  for (const NamedVerdict& one : verdicts) {
    worst.judgement = std::max(worst.judgement, one.verdict.judgement);
    worst.failure_probability = std::fmax(worst.failure_probability, one.verdict.failure_probability);
  }
  return worst;
}

std::string probability_text(double failure_probability) {
  if (std::isnan(failure_probability)) return "not known";
  return percent_text(failure_probability, failure_probability < 0.0995 ? 1 : 0) + " %";
}

}  // namespace marrow
