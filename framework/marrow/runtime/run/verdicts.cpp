// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/verdicts.hpp"

#include <cmath>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"

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

namespace {

using Use = std::function<void(const std::string&, const Value&)>;

void visit(const Value& value, const std::string& item, const Use& use) {
  for (std::size_t i = 0; i < value.items.size(); ++i)
    visit(value.items[i], (item.empty() ? "" : item + "/") + value.names[i], use);
  if (!value.is_list() && !value.is_absent()) use(item, value);
}

}  // namespace

void for_each_item(const Pipeline& pipeline, const RunResult& result, const TypeInfo& type,
                   const std::function<void(const std::string&, const std::string&, const Value&)>& use) {
  for (const PipelineOutput& output : pipeline.outputs) {
    if (pipeline.output_of(output.source).type != type) continue;
    try {
      visit(value_of(result, output.source), "",
            [&](const std::string& item, const Value& value) { use(output.name, item, value); });
    } catch (const Error&) {  // the list does not have this item: the output's own fault says so
    }
  }
}

nlohmann::json json_of(const NamedVerdict& one) {
  const double probability = one.verdict.failure_probability;
  return {{"output", one.output},
          {"item", one.item},
          {"judgement", name_of(one.verdict.judgement)},
          {"failure_probability", std::isfinite(probability) ? nlohmann::json(probability) : nlohmann::json()},
          {"reasons", one.verdict.reasons},
          {"remedies", one.verdict.remedies}};
}

std::vector<NamedVerdict> verdicts_in(const nlohmann::json& record) {
  std::vector<NamedVerdict> verdicts;
  for (const nlohmann::json& item : record.value("verdicts", nlohmann::json::array())) try {
      NamedVerdict one{item.at("output"), item.at("item"), {}};
      const auto judgement = judgement_named(item.at("judgement").get<std::string>());
      if (!judgement) continue;
      one.verdict.judgement = *judgement;
      if (const nlohmann::json& probability = item.at("failure_probability"); !probability.is_null())
        one.verdict.failure_probability = probability.get<double>();
      one.verdict.reasons = item.at("reasons").get<std::vector<std::string>>();
      one.verdict.remedies = item.at("remedies").get<std::vector<std::string>>();
      verdicts.push_back(std::move(one));
    } catch (const nlohmann::json::exception&) {  // damaged
    }
  return verdicts;
}

}  // namespace marrow
