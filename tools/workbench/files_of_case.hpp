// SPDX-License-Identifier: Apache-2.0
#pragma once
// Writes a case's folder so that nothing is lost, even if an interruption comes in the middle.
#include <filesystem>
#include <functional>
#include <string>

namespace marrow::workbench {

struct PlannedCase;

/// Whether two files hold the same bytes, or two folders the same names with the same bytes. False if one cannot be
/// read.
bool is_same_content(const std::filesystem::path& a, const std::filesystem::path& b);

/// Puts the whole case into a hidden folder inside `place` and checks it there. Only then moves what is new to its
/// place; landmarks.yaml and case.yaml come last and replace older ones. No other file is replaced or removed. `check`
/// gets the hidden folder and throws if the case is not good. After any exception, the old case is unchanged.
void write_case_files(const std::filesystem::path& place, const PlannedCase& plan, const std::string& case_text,
                      const std::string& landmarks_text,
                      const std::function<void(const std::filesystem::path&)>& check);

}  // namespace marrow::workbench
