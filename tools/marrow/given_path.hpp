// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

namespace marrow::cli {

/// What a command wants to be given.
enum class Wanted { pipeline, experiment, run };

/// Throws Error if the path names something of marrow that is not the wanted thing. The error says what it is and what
/// to do with it. All other paths pass: their reader says what is wrong.
void expect_given(const std::filesystem::path& given, Wanted wanted);

}  // namespace marrow::cli
