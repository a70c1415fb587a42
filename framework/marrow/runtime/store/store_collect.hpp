// SPDX-License-Identifier: Apache-2.0
#pragma once
// Lists what the folder of a store holds, and keeps it within its size.
#include <time.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "marrow/runtime/store/store.hpp"

namespace marrow {

/// MARROW_CACHE_GB, or "20" if it is not set or empty.
std::string given_gigabytes();

/// As Store::entries().
std::vector<Store::Entry> entries_in(const std::filesystem::path& folder);

/// As Store::collect(). Also removes claims whose owners have ended. `now` is the time by the clock of the folder's
/// file system (time_in()). Without it, nothing counts as left behind because of its age. Stops between two items when
/// `cancelled` becomes true.
Store::Freed collect_in(const std::filesystem::path& folder, std::uint64_t keep_bytes,
                        const std::optional<timespec>& now, const std::atomic<bool>* cancelled = nullptr);

}  // namespace marrow
