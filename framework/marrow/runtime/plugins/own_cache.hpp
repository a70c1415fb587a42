// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

namespace marrow {

// The folder that keeps descriptions of libraries: marrow/libraries in the user's cache folder. If others could change
// it or the folders above it, nothing is kept and nothing is found.

/// The text of a file in this folder. Nothing if it is missing, is longer than `most_bytes` or belongs to someone else.
std::optional<std::string> own_cached_text(const std::string& name, std::size_t most_bytes);

/// Writes a file in this folder, for the user alone. If it cannot be written, nothing is kept: it is only a cache.
void keep_in_own_cache(const std::string& name, const std::string& text);

/// Removes a file in this folder.
void forget_in_own_cache(const std::string& name);

}  // namespace marrow
