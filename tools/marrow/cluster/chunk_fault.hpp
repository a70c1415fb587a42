// SPDX-License-Identifier: Apache-2.0
#pragma once
// Why a task could not do its chunk, in one sentence: FOLDER/rows/CHUNK.fault. What it printed may be on another host.
#include <filesystem>
#include <string>

namespace marrow::cli {

/// Does nothing if the file cannot be written: the task prints the sentence, too.
void leave_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk, const std::string& fault);
/// To be called when the chunk is done.
void remove_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);
/// The sentence, without control characters; empty if there is none.
std::string fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);

}  // namespace marrow::cli
