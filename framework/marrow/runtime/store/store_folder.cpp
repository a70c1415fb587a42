// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/store/store_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sys/file.h>
#include <cerrno>
#include <cstdio>

#include "marrow/base/framework_file.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/runtime/store/store.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kWhat = "marrow store of results, layout ";
constexpr std::string_view kLayout = "1";

bool is_digits(std::string_view text, const char* digits) {
  return !text.empty() && text.find_first_not_of(digits) == std::string_view::npos;
}

/// The key that a name in the store stands for: 32 digits as Digest::hex() writes them.
std::optional<Digest> key_of_name(const std::string& name) {
  return is_digits(name, "0123456789abcdef") ? digest_of_hex(name) : std::nullopt;
}

/// The kind of the files in a folder of a store; nothing for a folder of entries.
std::optional<StoreItem::Kind> kind_in(const std::string& folder) {
  if (folder == "last" || folder == "digests") return StoreItem::Kind::remembered;
  if (folder == "claims") return StoreItem::Kind::claim;
  return std::nullopt;
}

struct TemporaryName {
  std::string final, writer;
};

std::optional<TemporaryName> temporary_of_name(const std::string& name) {
  constexpr std::string_view kMiddle = ".tmp-";
  const std::size_t middle = name.find(kMiddle);
  if (middle == std::string::npos) return std::nullopt;
  const std::string_view rest = std::string_view(name).substr(middle + kMiddle.size());
  const std::size_t dash = rest.find('-');
  if (dash == std::string_view::npos || !is_digits(rest.substr(dash + 1), "0123456789")) return std::nullopt;
  const std::string_view writer = rest.substr(0, dash);
  const bool is_number = is_digits(writer, "0123456789") && writer[0] != '0';  // an older marrow wrote only that
  if (!is_number && !is_identity(writer)) return std::nullopt;
  return TemporaryName{name.substr(0, middle), std::string(writer)};
}

/// Calls visit(name, path, is_folder) for each regular file and folder in a folder; links and everything else are
/// ignored. If the folder cannot be read, `fault` says so, unless it already has a text.
template <class Visit>
void for_each_in(const fs::path& folder, std::string& fault, const Visit& visit) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    std::error_code gone;
    const fs::file_status status = at->symlink_status(gone);
    if (fs::is_regular_file(status) || fs::is_directory(status))
      visit(at->path().filename().string(), at->path(), fs::is_directory(status));
  }
  if (error && error != std::errc::no_such_file_or_directory && fault.empty())
    fault = "cannot look into the folder " + folder.string() + ": " + error.message();
}

enum class Mark { none, ours, other_layout, unknown };

Mark mark_of(const fs::path& folder) {
  std::error_code error;
  const fs::path path = folder / kStoreMarker;
  if (fs::symlink_status(path, error).type() == fs::file_type::not_found) return Mark::none;
  const StoreFile file(path);
  std::string text(std::min<std::size_t>(file.size(), 100), '\0');
  if (!file.is_open() || !file.read(text.data(), text.size(), 0) || !text.starts_with(kWhat)) return Mark::unknown;
  return text.starts_with(std::string(kWhat).append(kLayout) + "\n") ? Mark::ours : Mark::other_layout;
}

const std::string kChooseAnother = "; set MARROW_CACHE to a new or empty folder of your own";

/// examine_store() for a folder that exists and belongs to this user.
FolderState examine_own(const fs::path& folder, mode_t mode) {
  Mark mark = mark_of(folder);
  const bool is_new = mark == Mark::none && holds_nothing(folder);
  if (mark == Mark::none && !is_new) mark = mark_of(folder);  // another process may just have made it a store
  // That process makes the folder private before it marks it. So `mode` may be out of date.
  struct stat status;
  if (mark == Mark::ours && stat(folder.c_str(), &status) == 0) mode = status.st_mode;
  const std::string name = "the folder " + folder.string();
  if (mark == Mark::other_layout) return {false, name + " is a store of another version of marrow" + kChooseAnother};
  if (mark != Mark::ours && !is_new)
    return {false, name + " holds other things and is no store of marrow" + kChooseAnother};
  // An empty folder becomes private when it becomes a store. But a folder that all users share must not be taken from
  // them.
  if ((mode & (S_IWGRP | S_IWOTH)) && (!is_new || (mode & S_ISVTX)))
    return {false,
            "other users may write to " + folder.string() + "; take that from them (chmod go-w), or set MARROW_CACHE"};
  if (faccessat(AT_FDCWD, folder.c_str(), R_OK | W_OK | X_OK, AT_EACCESS) != 0)
    return {false, "cannot write to " + folder.string() + ": " + std::strerror(errno)};
  return {mark == Mark::ours, ""};
}

/// Closing it releases its locks.
Descriptor open_folder(const fs::path& folder) {
  return Descriptor(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
}

bool is_still(const Descriptor& opened, const fs::path& folder) {
  struct stat held {
  }, named{};
  return fstat(opened, &held) == 0 && lstat(folder.c_str(), &named) == 0 && held.st_dev == named.st_dev &&
         held.st_ino == named.st_ino;
}

}  // namespace

FolderState examine_store(const fs::path& folder) {
  if (folder.empty())
    return {false,
            "neither HOME nor the system names a home folder of this user; set MARROW_CACHE to a folder for them"};
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    const int number = errno;
    if (number == ENOENT && lstat(folder.c_str(), &status) != 0) return {};
    // If it is no link, another process has made it in the meantime.
    if (number != ENOENT || S_ISLNK(status.st_mode))
      return {false, "cannot use the folder " + folder.string() + ": " + std::strerror(number) + kChooseAnother};
  }
  if (!S_ISDIR(status.st_mode)) return {false, folder.string() + " is no folder" + kChooseAnother};
  if (status.st_uid != geteuid())
    return {false,
            "the folder " + folder.string() + " belongs to another user, " + user_name(status.st_uid) + kChooseAnother};
  return examine_own(folder, status.st_mode);
}

std::string make_store(const fs::path& folder) {
  FolderState state = examine_store(folder);
  if (state.is_store || !state.fault.empty()) return state.fault;
  if (std::string fault = make_private_folder(folder); !fault.empty()) return fault;
  state = examine_store(folder);  // another user may have been quicker
  if (state.is_store || !state.fault.empty()) return state.fault;
  chmod(folder.c_str(), 0700);
  // Durable, because a folder with entries but without a marker would never be used again.
  const std::string fault = write_whole(
      folder / kStoreMarker,
      [](Archive& out) {
        for (std::string_view part : {kWhat, kLayout, std::string_view("\n"), kStoreForPeople})
          out.bytes(part.data(), part.size());
      },
      true);
  return fault.empty() ? examine_store(folder).fault : fault;
}

fs::path entry_file(const fs::path& folder, const Digest& key) {
  const std::string name = key.hex();
  return folder / name.substr(0, 2) / name;
}

bool holds_nothing(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const auto temporary = temporary_of_name(at->path().filename().string());
    if (!temporary || temporary->final != kStoreMarker) return false;
  }
  return !error;
}

std::string make_private_folder(const fs::path& folder) {
  for (bool has_parent = false;; has_parent = true) {
    if (mkdir(folder.c_str(), 0700) == 0) {
      chmod(folder.c_str(), 0700);
      return "";
    }
    const int number = errno;
    std::error_code error;
    if (number == EEXIST && fs::is_directory(folder, error)) return "";
    if (number != ENOENT || has_parent || !folder.has_parent_path())
      return "cannot make the folder " + folder.string() + ": " + std::strerror(number);
    if (std::string fault = make_private_folder(folder.parent_path()); !fault.empty()) return fault;
  }
}

std::string make_shared_folder(const fs::path& folder, const Permissions& permissions) {
  const auto fault = [&] { return "cannot make the folder " + folder.string() + ": " + std::strerror(errno); };
  const fs::path temporary = temporary_beside(folder);
  if (mkdir(temporary.c_str(), 0700) != 0) return fault();
  Descriptor descriptor(open(temporary.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  bool is_done = descriptor.is_open() && permit(descriptor, permissions.folder, permissions);
  // Another process may have been quicker.
  is_done = is_done && (std::rename(temporary.c_str(), folder.c_str()) == 0 || errno == EEXIST || errno == ENOTEMPTY);
  const std::string text = is_done ? "" : fault();
  rmdir(temporary.c_str());
  return text;
}

fs::path new_folder_beside(const fs::path& final) {
  if (const std::string fault = make_private_folder(final.parent_path()); !fault.empty()) throw Error(fault);
  fs::path temporary;
  do temporary = temporary_beside(final);
  while (mkdir(temporary.c_str(), 0700) != 0 && errno == EEXIST);
  if (chmod(temporary.c_str(), 0700) != 0) {
    const int number = errno;
    rmdir(temporary.c_str());
    throw Error("cannot make the folder " + temporary.string() + ": " + std::strerror(number));
  }
  return temporary;
}

std::vector<StoreItem> items_of_store(const fs::path& folder, std::string& fault) {
  using Kind = StoreItem::Kind;
  std::vector<StoreItem> items;
  const auto add_temporary = [&](const std::string& name, const fs::path& path, const auto& is_ours) {
    const auto temporary = temporary_of_name(name);
    if (temporary && is_ours(temporary->final)) items.push_back({Kind::temporary, path, {}, temporary->writer});
  };
  const auto is_key = [](const std::string& name) { return key_of_name(name).has_value(); };
  const auto is_folder_of_keys = [](const std::string& name) {
    return kind_in(name).has_value() || (name.size() == 2 && is_digits(name, "0123456789abcdef"));
  };
  for_each_in(folder, fault, [&](const std::string& name, const fs::path& path, bool is_folder) {
    if (!is_folder) {
      add_temporary(name, path, [](const std::string& final) { return final == kStoreMarker || final == "tidied"; });
    } else if (name == "cases") {
      for_each_in(path, fault, [&](const std::string& inner, const fs::path& at, bool is_case) {
        std::error_code error;
        if (const auto key = key_of_name(inner); key && is_case && fs::is_regular_file(at / "content.txt", error))
          items.push_back({Kind::simulated_case, at, *key, ""});
        else if (is_case)
          add_temporary(inner, at, is_key);
      });
    } else if (is_folder_of_keys(name)) {
      const Kind kind = kind_in(name).value_or(Kind::entry);
      for_each_in(path, fault, [&](const std::string& inner, const fs::path& at, bool is_other) {
        if (is_other || (kind == Kind::entry && !inner.starts_with(name))) return;
        if (const auto key = key_of_name(inner))
          items.push_back({kind, at, *key, ""});
        else
          add_temporary(inner, at, is_key);
      });
    } else {
      add_temporary(name, path, is_folder_of_keys);
    }
  });
  return items;
}

std::optional<timespec> time_in(const fs::path& folder, const Permissions& permissions) {
  const fs::path file = temporary_beside(folder / kStoreMarker);
  const Descriptor descriptor(open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0600));
  if (!descriptor.is_open()) return std::nullopt;
  permit(descriptor, permissions.file, permissions);
  struct stat status {};
  const bool is_known = write(descriptor, "\n", 1) == 1 && fsync(descriptor) == 0 && fstat(descriptor, &status) == 0;
  unlink(file.c_str());
  return is_known ? std::optional(status.st_mtim) : std::nullopt;
}

bool is_abandoned(const StoreItem& temporary, const std::optional<timespec>& now) {
  constexpr time_t kDay_s = 24 * 3600;
  if (life_of(temporary.writer) == Life::ended) return true;
  struct stat status {};
  return now && lstat(temporary.path.c_str(), &status) == 0 && now->tv_sec - status.st_mtime > kDay_s;
}

std::shared_ptr<const void> use_folder(const fs::path& folder) {
  const auto held = std::make_shared<Descriptor>(open_folder(folder));
  if (!held->is_open()) return nullptr;
  // This wait is short: a process that removes a folder locks it only while it renames it.
  while (flock(*held, LOCK_SH) != 0 && errno == EINTR) continue;
  return is_still(*held, folder) ? held : nullptr;
}

void rename_unused(const fs::path& folder, const fs::path& to, std::error_code& error) {
  const Descriptor held = open_folder(folder);
  const bool is_gone = !held.is_open() && errno == ENOENT;
  if (held.is_open() && flock(held, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    error = std::make_error_code(std::errc::device_or_resource_busy);
    return;
  }
  // If it was missing, or another process renamed it before it was locked, a new folder without a lock may have its
  // name.
  if (is_gone || (held.is_open() && !is_still(held, folder))) {
    error = std::make_error_code(std::errc::no_such_file_or_directory);
    return;
  }
  fs::rename(folder, to, error);
}

}  // namespace marrow
