// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>

#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {

/// An event of a run as `marrow run --json` prints it, and as the pages of `marrow open` get it: {event, node}, and of
/// {item, text, level, fraction, seconds} those that it has.
nlohmann::json json_of(const RunEvent& event);

}  // namespace marrow::cli
