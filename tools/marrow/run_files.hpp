// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files of a run's folder, which may be damaged, or come from somebody else.
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow::cli {

/// run.json of a run's folder. Throws Error where it is no object, or cannot be read.
nlohmann::json read_record(const std::filesystem::path& folder);

/// [throws Error] that run.json is damaged, and how.
[[noreturn]] void refuse_record(const std::filesystem::path& folder, const std::string& why);

/// A regular file that a record names below the run's folder. Nothing where there is none, or where the name or a link
/// leads out of the folder: a page or a comparison of runs shows nothing else of this machine.
std::optional<std::filesystem::path> file_of_run(const std::filesystem::path& folder, const std::string& name);

/// Whether the name leads to something outside the folder.
bool leads_outside(const std::filesystem::path& folder, const std::string& name);

/// Throws Error where it does.
void refuse_outside(const std::filesystem::path& folder, const std::string& name);

/// A PNG's pixels, three bytes each.
struct RgbPixels {
  int width_px = 0, height_px = 0;
  bool is_wide = false;  ///< the file has 16 bits a channel
  std::vector<std::uint8_t> bytes;
};
/// Throws Error for a file that is no PNG, is damaged, or has more than 40 million pixels.
RgbPixels read_png(const std::filesystem::path& file);

}  // namespace marrow::cli
