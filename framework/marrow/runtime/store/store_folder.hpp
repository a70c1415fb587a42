// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a store's folder looks like, and who may use it:
//   marrow-store            says that this is a store, and which layout it has
//   01/01...HEX             entries, in folders named by the first two digits of their keys
//   cases/HEX/              simulated cases
//   last/HEX                the last results of a run, or of one pass of a body
//   digests/HEX             digests of large files
//   claims, tidied          locks; the time when the store was last tidied up
//   NAME.tmp-PROCESS-NUMBER any of these while it is being written
// A shared store (shared_folder.hpp) has the same entries, and for each claim a file claims/HEX.
#include <time.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "marrow/runtime/store/store_file.hpp"

namespace MARROW_EXPORT marrow {

inline constexpr std::string_view kStoreMarker = "marrow-store";
inline constexpr std::string_view kStoreForPeople =
    "Made and tidied up by marrow: see 'marrow cache'. It may be removed as a whole.\n";  // in the marker

struct FolderState {
  bool is_store = false;
  std::string fault;  ///< why it cannot be used; empty for a store, and for a folder that is absent or empty
};
FolderState examine_store(const std::filesystem::path& folder);
/// Turns an absent or empty folder into a store. Returns why the folder cannot be used, or an empty text.
std::string make_store(const std::filesystem::path& folder);

/// The file of the entry with this key.
std::filesystem::path entry_file(const std::filesystem::path& folder, const Digest& key);

/// Whether a folder is empty, apart from markers that are being written. False if it cannot be read.
bool holds_nothing(const std::filesystem::path& folder);

/// Makes a folder that only its owner can look into, with any umask. Makes missing folders above it in the same way. An
/// existing folder is not changed. Returns why this failed, or an empty text.
std::string make_private_folder(const std::filesystem::path& folder);
/// Makes a folder of a shared store. It has its permissions from the moment it can be seen. The folder above must
/// exist. An existing folder is not changed. Returns why this failed, or an empty text.
std::string make_shared_folder(const std::filesystem::path& folder, const Permissions& permissions);

/// Makes a new private folder with a temporary name. Throws Error if it cannot.
std::filesystem::path new_folder_beside(const std::filesystem::path& final);

/// Something in a store that can be removed.
struct StoreItem {
  enum class Kind { entry, simulated_case, remembered, claim, temporary };
  Kind kind = Kind::entry;
  std::filesystem::path path;
  Digest key;          ///< of an entry, a simulated case or a claim, or hash of the place in last/
  std::string writer;  ///< identity of the process that writes a temporary; a number if an older marrow left it
};
/// The items of a store: only files and folders of the right type with names that the store gives. Links, and files
/// that others put there, are not listed. If a folder of the store could not be read, `fault` says why, and there may
/// be more items.
std::vector<StoreItem> items_of_store(const std::filesystem::path& folder, std::string& fault);

/// The present time by the clock of the folder's file system: the time of a file that is written for this purpose.
/// Nothing if no file can be written.
std::optional<timespec> time_in(const std::filesystem::path& folder, const Permissions& permissions = {});
/// Whether the process that writes a temporary has ended. If that cannot be known, because it runs on another host or
/// left no identity, it counts as ended when the file was not changed for a day before `now`.
bool is_abandoned(const StoreItem& temporary, const std::optional<timespec>& now);

// Folders of a store are marked as used, so that no other process removes them. If a process dies, the kernel ends its
// use. On file systems without locks, this has no effect.

/// Holds the folder as long as the returned pointer lives. Returns nullptr if the folder does not exist (any more).
std::shared_ptr<const void> use_folder(const std::filesystem::path& folder);

/// Renames the folder, unless a process holds it: then `error` is std::errc::device_or_resource_busy.
void rename_unused(const std::filesystem::path& folder, const std::filesystem::path& to, std::error_code& error);

}  // namespace marrow
