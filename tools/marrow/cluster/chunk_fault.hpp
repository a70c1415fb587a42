// SPDX-License-Identifier: Apache-2.0
#pragma once
// FOLDER/rows/CHUNK.fault says in one sentence why a task could not do its chunk. The task's output may be on another
// host.
#include <filesystem>
#include <string>

namespace marrow::cli {

/// Writes the sentence. Ignores that it cannot be written: the task prints it, too.
void leave_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk, const std::string& fault);
/// Call this when the chunk is done.
void remove_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);
/// The sentence, without control characters; empty if there is none.
std::string fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);

}  // namespace marrow::cli
