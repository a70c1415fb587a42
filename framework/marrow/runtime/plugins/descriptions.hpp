// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace MARROW_EXPORT marrow {
/// The worker's side of describe_library(): the answer to {"do": "describe", "library": ...} is the library_json().
nlohmann::json answer_describe(const nlohmann::json& request, WorkerReports& reports);
}  // namespace marrow

namespace marrow {

/// Removes the kept description of a library that turned out to be different, so that the library is described again.
void forget_description(const LibraryInfo& library);

/// A description in the user's cache, by the name that keep_description() gave it; nothing if there is none. The caller
/// checks that it is not stale.
std::optional<LibraryInfo> kept_description(const Digest& name, const Digest& framework);
/// Keeps a description in the user's cache, unless it is a refusal whose reason may be gone next time.
void keep_description(const LibraryInfo& info, const Digest& name, const Digest& framework);

/// Where the manifest of a library is, if it has one.
std::filesystem::path manifest_beside(const std::filesystem::path& library);

/// The limits of a process that describes a library.
inline constexpr int kDescribeLimit_s = 20, kDescribeLimit_mb = 4096;
/// Why such a process gave no description, for LibraryInfo::refused. `used` says what it did to the library: "loaded".
std::string why_not_described(const WorkerEnd& end, const std::string& used);

/// What a person can do about a wrong description.
std::string cure_of_description(const std::filesystem::path& library);

// The folder that keeps descriptions of libraries: marrow/libraries in the user's cache folder. If others could change
// it or the folders above it, nothing is kept and nothing is found.

/// The text of a file in this folder. Nothing if it is missing, is longer than `most_bytes` or belongs to someone else.
std::optional<std::string> own_cached_text(const std::string& name, std::size_t most_bytes);

/// Writes a file in this folder, for the user alone. If it cannot be written, nothing is kept: it is only a cache.
void keep_in_own_cache(const std::string& name, const std::string& text);

/// Removes a file in this folder.
void forget_in_own_cache(const std::string& name);

}  // namespace marrow
