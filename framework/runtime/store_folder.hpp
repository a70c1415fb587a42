// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a store's folder looks like, and who may use it:
//   marrow-store            says that it is a store, and of which layout
//   01/01...HEX             entries, below the first two digits of their keys
//   cases/HEX/              simulated cases
//   last/HEX                what nodes last came to
//   claims, tidied          locks; when it was last tidied up
//   NAME.tmp-PROCESS-NUMBER any of these while it is written
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/runtime/hash.hpp"

namespace marrow {

inline constexpr std::string_view kStoreMarker = "marrow-store";

struct FolderState {
  bool is_store = false;
  std::string fault;  ///< why it is not used; empty for a store, and for a folder that is absent or empty
};
FolderState examine_store(const std::filesystem::path& folder);
/// Makes an absent or empty folder a store. Returns why the folder cannot be used as one.
std::string make_store(const std::filesystem::path& folder);

/// Makes a folder that only its owner can look into, whatever the umask, and likewise the folders above it that are
/// missing. Returns why that failed; a folder that is there already is left as it is.
std::string make_private_folder(const std::filesystem::path& folder);

/// A name for a file or folder that is renamed to `final` when it is complete. Each call gives another one.
std::filesystem::path temporary_beside(const std::filesystem::path& final);
/// Makes a new private folder with such a name. Throws Error where it cannot.
std::filesystem::path new_folder_beside(const std::filesystem::path& final);

/// Something in a store that can be removed.
struct StoreItem {
  enum class Kind { entry, simulated_case, remembered, temporary };
  Kind kind = Kind::entry;
  std::filesystem::path path;
  Digest key;       ///< of an entry or a simulated case; what names a place in last/
  int process = 0;  ///< that writes a temporary
};
/// Only what bears a name that the store gives and is of the right sort: no links, nothing that others put there.
/// `fault`: why there may be more, where a folder of the store could not be read.
std::vector<StoreItem> items_of_store(const std::filesystem::path& folder, std::string& fault);

}  // namespace marrow
