// SPDX-License-Identifier: Apache-2.0
#pragma once
// Figures as JSON that any program can write: {"name": 1.5, "other": {"value": 2, "unit": "mm"}}.
#include <filesystem>
#include <string>

#include "marrow/domain/features.hpp"

namespace marrow::run {

std::string metrics_text(const Metrics& metrics);

/// Throws Error if the file holds anything else.
Metrics read_metrics(const std::filesystem::path& file);

}  // namespace marrow::run
