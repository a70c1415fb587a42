// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/verdicts.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

void add_verdicts(const Value& value, const std::string& output, const std::string& item,
                  std::vector<NamedVerdict>& verdicts) {
  for (std::size_t i = 0; i < value.items.size(); ++i)
    add_verdicts(value.items[i], output, (item.empty() ? "" : item + "/") + value.names[i], verdicts);
  if (!value.is_list() && !value.is_absent()) verdicts.push_back({output, item, value.as<Verdict>()});
}

}  // namespace

std::vector<NamedVerdict> verdicts_of(const Pipeline& pipeline, const RunResult& result) {
  std::vector<NamedVerdict> verdicts;
  for (const PipelineOutput& output : pipeline.outputs) {
    if (pipeline.output_of(output.source).type != TypeInfo::of<Verdict>()) continue;
    try {
      add_verdicts(value_of(result, output.source), output.name, "", verdicts);
    } catch (const Error&) {  // the list does not have this item: the output's own fault says so
    }
  }
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
