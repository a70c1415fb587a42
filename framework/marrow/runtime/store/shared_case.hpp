// SPDX-License-Identifier: Apache-2.0
#pragma once
// A simulated case, a folder with files, as one entry of a shared store: its leaves are the files, by their names.
#include <filesystem>

#include "marrow/runtime/store/store_entry.hpp"

namespace marrow {

/// Throws Error if a file of the folder cannot be read or changes meanwhile.
void pack_case(Archive& out, const Digest& key, const std::filesystem::path& folder);
/// Writes the files into a new folder. Returns false if the entry is not the whole case of that key, or if the files
/// cannot be written; the folder is then gone or incomplete.
bool unpack_case(const StoreFile& file, const Digest& key, const std::filesystem::path& folder);

}  // namespace marrow
