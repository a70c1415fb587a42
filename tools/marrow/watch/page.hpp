// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow::cli {

/// What an open page of `marrow watch` shows. It looks for a new state every second.
struct PageState {
  std::string report;  ///< the last good report, relative to the page; empty if there is none yet
  std::string doing;   ///< what is done now; empty: nothing, it waits for a change
  std::string fault;   ///< what the last try ended with; empty if it was good
};

/// Writes index.html into the folder of a watch.
void write_page(const std::filesystem::path& folder, const std::string& title);
void write_state(const std::filesystem::path& folder, const PageState& state);

}  // namespace marrow::cli
