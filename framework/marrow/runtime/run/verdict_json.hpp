// SPDX-License-Identifier: Apache-2.0
#pragma once
// Verdicts as the record of a run and the events of --json have them.
#include <nlohmann/json.hpp>
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/runtime/run/verdicts.hpp"

namespace MARROW_EXPORT marrow {

/// {output, item, judgement, failure_probability, reasons, remedies}; a probability that is not known is null.
nlohmann::json json_of(const NamedVerdict& one);

/// The `verdicts` of a run's record. Those that are damaged are left out.
std::vector<NamedVerdict> verdicts_in(const nlohmann::json& record);

}  // namespace marrow
