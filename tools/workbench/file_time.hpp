// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow::workbench {

/// When the file was written, in UTC: "2026-01-31T12:00:00Z". Empty if that cannot be read.
std::string time_of_file(const std::filesystem::path& file);

}  // namespace marrow::workbench
