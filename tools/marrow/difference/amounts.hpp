// SPDX-License-Identifier: Apache-2.0
#pragma once
// The amount by which two values differ, in terms of the field: degrees and mm, figures of merit, samples.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/runtime/node/value.hpp"

namespace marrow::cli {

struct Amount {
  std::vector<std::string> lines;                   ///< for people
  nlohmann::json facts = nlohmann::json::object();  ///< for scripts
};

/// For two items of a type that all plugins share. `lines` is empty if the type is another one, or if the types differ.
Amount amount_of(const Value& before, const Value& now);

/// For values that are known only as bytes. `what` names the bytes in the text.
Amount amount_of_bytes(const std::string& before, const std::string& now, const std::string& what);
/// The same for two files, which may be larger than the memory.
Amount amount_of_files(const std::filesystem::path& before, const std::filesystem::path& now);

}  // namespace marrow::cli
