// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/verdict_json.hpp"

#include <cmath>

#include "marrow/base/error.hpp"

namespace marrow {

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
