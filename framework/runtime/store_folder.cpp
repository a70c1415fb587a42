// SPDX-License-Identifier: Apache-2.0
#include "store_folder.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <optional>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/store.hpp"
#include "store_file.hpp"
#include "user_folder.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kWhat = "marrow store of results, layout ";
constexpr std::string_view kLayout = "1";
constexpr std::string_view kForPeople =
    "Made and tidied up by marrow: see 'marrow cache'. It may be removed as a whole.";

bool is_digits(std::string_view text, const char* digits) {
  return !text.empty() && text.find_first_not_of(digits) == std::string_view::npos;
}

/// The key that a name in the store stands for: 32 digits as Digest::hex() writes them.
std::optional<Digest> key_of_name(const std::string& name) {
  return is_digits(name, "0123456789abcdef") ? digest_of_hex(name) : std::nullopt;
}

struct TemporaryName {
  std::string final;
  int process = 0;
};

std::optional<TemporaryName> temporary_of_name(const std::string& name) {
  constexpr std::string_view kMiddle = ".tmp-";
  const std::size_t middle = name.find(kMiddle);
  if (middle == std::string::npos) return std::nullopt;
  const std::string_view numbers = std::string_view(name).substr(middle + kMiddle.size());
  const std::size_t dash = numbers.find('-');
  if (dash == std::string_view::npos || !is_digits(numbers.substr(0, dash), "0123456789") ||
      !is_digits(numbers.substr(dash + 1), "0123456789"))
    return std::nullopt;
  TemporaryName found{name.substr(0, middle), 0};
  const auto parsed = std::from_chars(numbers.data(), numbers.data() + dash, found.process);
  if (parsed.ec != std::errc() || found.process <= 0) return std::nullopt;
  return found;
}

/// Calls visit(name, path, is_folder) for each regular file and folder in a folder. Links and everything else are left
/// out. If the folder cannot be read, `fault` says so, unless it already has a text.
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

/// Whether a folder is empty, apart from markers that are being written. False if it cannot be read.
bool holds_nothing(const fs::path& folder) {
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const auto temporary = temporary_of_name(at->path().filename().string());
    if (!temporary || temporary->final != kStoreMarker) return false;
  }
  return !error;
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

}  // namespace

FolderState examine_store(const fs::path& folder) {
  if (folder.empty())
    return {false,
            "neither HOME nor the system names a home folder of this user; set MARROW_CACHE to a folder for them"};
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0) {
    const int number = errno;
    if (number == ENOENT && lstat(folder.c_str(), &status) != 0) return {};
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
        for (std::string_view part : {kWhat, kLayout, std::string_view("\n"), kForPeople, std::string_view("\n")})
          out.bytes(part.data(), part.size());
      },
      true);
  return fault.empty() ? examine_store(folder).fault : fault;
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

fs::path temporary_beside(const fs::path& final) {
  static std::atomic<std::uint64_t> number{0};
  return final.string() + ".tmp-" + std::to_string(getpid()) + "-" + std::to_string(number++);
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
    if (temporary && is_ours(temporary->final)) items.push_back({Kind::temporary, path, {}, temporary->process});
  };
  const auto is_key = [](const std::string& name) { return key_of_name(name).has_value(); };
  for_each_in(folder, fault, [&](const std::string& name, const fs::path& path, bool is_folder) {
    if (!is_folder) {
      add_temporary(name, path, [](const std::string& final) { return final == kStoreMarker || final == "tidied"; });
    } else if (name == "cases") {
      for_each_in(path, fault, [&](const std::string& inner, const fs::path& at, bool is_case) {
        std::error_code error;
        if (const auto key = key_of_name(inner); key && is_case && fs::is_regular_file(at / "content.txt", error))
          items.push_back({Kind::simulated_case, at, *key, 0});
        else if (is_case)
          add_temporary(inner, at, is_key);
      });
    } else if (name == "last" || (name.size() == 2 && is_digits(name, "0123456789abcdef"))) {
      for_each_in(path, fault, [&](const std::string& inner, const fs::path& at, bool is_other) {
        if (is_other || (name != "last" && !inner.starts_with(name))) return;
        if (const auto key = key_of_name(inner))
          items.push_back({name == "last" ? Kind::remembered : Kind::entry, at, *key, 0});
        else
          add_temporary(inner, at, is_key);
      });
    }
  });
  return items;
}

}  // namespace marrow
