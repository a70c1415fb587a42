// SPDX-License-Identifier: Apache-2.0
#pragma once
// By how much two values differ, in the terms of the field: degrees and mm, figures of merit, samples.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/runtime/value.hpp"

namespace marrow::cli {

struct Amount {
  std::vector<std::string> lines;                   ///< for people
  nlohmann::json facts = nlohmann::json::object();  ///< for scripts
};

/// Of two items of the types that all plugins share. Empty lines where the type is another, or the two are of different
/// types.
Amount amount_of(const Value& before, const Value& now);

/// Of values of which nothing is known but their bytes: `what` names those.
Amount amount_of_bytes(const std::string& before, const std::string& now, const std::string& what);
/// The same of two files, which may be larger than the memory.
Amount amount_of_files(const std::filesystem::path& before, const std::filesystem::path& now);

}  // namespace marrow::cli
