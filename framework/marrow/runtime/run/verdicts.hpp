// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"
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

}  // namespace marrow
