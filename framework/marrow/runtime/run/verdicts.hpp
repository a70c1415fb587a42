// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/run/executor.hpp"

namespace MARROW_EXPORT marrow {

/// A verdict among the outputs of a run.
struct NamedVerdict {
  std::string output;  ///< the pipeline's name of it
  std::string item;    ///< its place along the axes, as "distal"; empty if the output is no list
  Verdict verdict;
};

/// The verdicts that a run made, in the order of the pipeline's outputs.
std::vector<NamedVerdict> verdicts_of(const Pipeline& pipeline, const RunResult& result);

/// The worst of the judgements and the largest of the known probabilities, without reasons. `verdicts` has one or more.
Verdict worst_of(const std::vector<NamedVerdict>& verdicts);

/// "0.3 %", "12 %", or "not known": the probability of a failure.
std::string probability_text(double failure_probability);

/// Calls use(name of the output, item, value) for each single value of this type among the outputs of a run. `item` is
/// its place along the axes ("distal/final"; empty outside lists). What the run did not make is left out.
void for_each_item(const Pipeline& pipeline, const RunResult& result, const TypeInfo& type,
                   const std::function<void(const std::string&, const std::string&, const Value&)>& use);

/// {output, item, judgement, failure_probability, reasons, remedies}; a probability that is not known is null.
nlohmann::json json_of(const NamedVerdict& one);

/// The `verdicts` of a run's record. Those that are damaged are left out.
std::vector<NamedVerdict> verdicts_in(const nlohmann::json& record);

}  // namespace marrow
