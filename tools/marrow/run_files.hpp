// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads the files of a run's folder. They may be damaged, or come from somebody else.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow::cli {

/// run.json of a run's folder. Throws Error if it cannot be read or is not a JSON object.
nlohmann::json read_record(const std::filesystem::path& folder);

/// Throws Error: run.json is damaged, and why.
[[noreturn]] void refuse_record(const std::filesystem::path& folder, const std::string& why);

/// The regular file in the run's folder that a record names. Nothing if it does not exist, or if the name or a link
/// leads out of the folder: a page or a comparison of runs must never show other files of this machine.
std::optional<std::filesystem::path> file_of_run(const std::filesystem::path& folder, const std::string& name);

/// Whether the name leads to something outside the folder.
bool leads_outside(const std::filesystem::path& folder, const std::string& name);

/// Throws Error if leads_outside().
void refuse_outside(const std::filesystem::path& folder, const std::string& name);

/// The pixels of a PNG, three bytes each.
struct RgbPixels {
  int width_px = 0, height_px = 0;
  bool is_wide = false;  ///< the file has 16 bits per channel
  std::vector<std::uint8_t> bytes;
};
/// Throws Error if the file is not a PNG, is damaged, or has more than 40 million pixels.
RgbPixels read_png(const std::filesystem::path& file);

}  // namespace marrow::cli
