// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json_fwd.hpp>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

class WorkerReports;

/// The worker's side of describe_library(): {"do": "describe", "library": ...}. The answer is the library_json().
nlohmann::json answer_describe(const nlohmann::json& request, WorkerReports& reports);

}  // namespace marrow
