// SPDX-License-Identifier: Apache-2.0
#pragma once
// The folder of a shared store: who may use it, and how its files are read although hosts see each other's files late.
//   marrow-store   says that this is a shared store
//   01/01...HEX    entries: results, and simulated cases as one file each
//   claims/HEX     who makes a result (shared_claim.hpp)
#include <filesystem>
#include <functional>
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/runtime/store/store_file.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

struct SharedFolderState {
  bool is_store = false;
  bool may_write = false;
  std::string fault;  ///< why it cannot be used
  Permissions permissions;
};
/// A shared store may belong to another user. The folder must exist; so a mount point without its mount is not taken
/// for it. Its files have the group's rights of the folder. Nobody else may read or write them.
SharedFolderState examine_shared(const std::filesystem::path& folder);
/// Turns an empty folder into a store. Returns what examine_shared() then says.
SharedFolderState make_shared(const std::filesystem::path& folder);

/// Whether the file's name is in its folder. Listing asks the server again. The folder itself may be new to this host.
bool is_listed(const std::filesystem::path& file);

/// `quick` relies on what this host remembers about a folder. `listed` lists the folder first, to learn of new files.
enum class SharedLook { quick, listed };

/// Opens a file and calls use(file). If it returns false, because the file cannot be read or is not whole, or if a file
/// that is listed cannot be opened, tries again with pauses, about a second in all. Returns whether use() returned
/// true. `fault` is set if the folder cannot be read at all.
bool read_shared(const std::filesystem::path& file, SharedLook look, const std::function<bool(const StoreFile&)>& use,
                 std::string& fault);

}  // namespace marrow
