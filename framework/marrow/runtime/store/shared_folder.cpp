// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/shared_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "marrow/runtime/store/store_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSharedLine = "marrow shared store of results, layout 1\n";
constexpr int kMostLooks = 6;
constexpr auto kFirstPause = std::chrono::milliseconds(20);  // each pause is twice as long as the one before
const std::string kWhereTo = "; set MARROW_SHARED_CACHE to a folder for it, or unset it";

bool is_marked(const fs::path& folder, SharedLook look) {
  std::string ignored;
  return read_shared(
      folder / kStoreMarker, look,
      [](const StoreFile& file) {
        std::string text(std::min<std::size_t>(file.size(), kSharedLine.size()), '\0');
        return file.read(text.data(), text.size(), 0) && text == kSharedLine;
      },
      ignored);
}

Permissions permissions_of(const struct stat& status) {
  return {status.st_mode & 0660, status.st_mode & (S_ISGID | 0770), status.st_gid};
}

/// Whether an error of opening means only that the file is not there, or is not there any more.
bool is_absence(int number) { return number == ENOENT || number == ESTALE || number == ELOOP; }

}  // namespace

SharedFolderState examine_shared(const fs::path& folder) {
  SharedFolderState state;
  const std::string name = "the folder " + folder.string();
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    state.fault = errno == ENOENT
                      ? name + " does not exist on this host; make it (for a group: mkdir -m 2770), or mount it"
                      : "cannot use the folder " + folder.string() + ": " + std::strerror(errno) + kWhereTo;
    return state;
  }
  state.permissions = permissions_of(status);
  state.may_write = faccessat(AT_FDCWD, folder.c_str(), W_OK, AT_EACCESS) == 0;
  if (!S_ISDIR(status.st_mode))
    state.fault = folder.string() + " is no folder" + kWhereTo;
  else if (status.st_mode & S_IWOTH)
    state.fault = "everybody may write to " + folder.string() + "; take that from them (chmod o-w)";
  else if (faccessat(AT_FDCWD, folder.c_str(), R_OK | X_OK, AT_EACCESS) != 0)
    state.fault = "cannot look into the folder " + folder.string() + ": " + std::strerror(errno);
  else if (is_marked(folder, SharedLook::quick))
    state.is_store = true;
  else if (!holds_nothing(folder)) {  // another process may be making it a store at this moment
    state.is_store = is_marked(folder, SharedLook::listed);
    if (!state.is_store) state.fault = name + " holds other things and is no shared store of marrow" + kWhereTo;
  } else if (!state.may_write)
    state.fault = name + " is empty, and this user may not write to it; ask its owner for the right";
  return state;
}

SharedFolderState make_shared(const fs::path& folder) {
  const SharedFolderState state = examine_shared(folder);
  if (state.is_store || !state.fault.empty()) return state;
  const std::string fault = write_whole(
      folder / kStoreMarker,
      [](Archive& out) {
        for (std::string_view part : {kSharedLine, kStoreForPeople}) out.bytes(part.data(), part.size());
      },
      true, state.permissions);
  SharedFolderState made = examine_shared(folder);
  if (made.fault.empty()) made.fault = fault;
  return made;
}

bool is_listed(const fs::path& file) {
  const fs::path folder = file.parent_path();
  std::error_code error;
  fs::directory_iterator at(folder, error);
  if (error) {
    const fs::directory_iterator above(folder.parent_path(), error);
    at = fs::directory_iterator(folder, error);
  }
  for (const fs::directory_iterator end; !error && at != end; at.increment(error))
    if (at->path().filename() == file.filename()) return true;
  return false;
}

bool read_shared(const fs::path& file, SharedLook look, const std::function<bool(const StoreFile&)>& use,
                 std::string& fault) {
  auto pause = kFirstPause;
  bool is_there = look == SharedLook::listed && is_listed(file);
  for (int tries = 1;; ++tries) {
    const StoreFile open_file(file);
    if (open_file.is_open()) {
      if (use(open_file)) return true;
      is_there = true;
    } else if (!is_absence(open_file.fault())) {
      fault = "cannot read " + file.string() + ": " + std::strerror(open_file.fault());
      return false;
    }
    if (!is_there || tries == kMostLooks) return false;
    std::this_thread::sleep_for(pause);
    pause *= 2;
    is_there = is_listed(file);
  }
}

}  // namespace marrow
