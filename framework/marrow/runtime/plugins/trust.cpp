// SPDX-License-Identifier: Apache-2.0
// Loading a library runs its code with the rights of the user. So a library that another user could have put there is
// not loaded.
#include "marrow/runtime/plugins/trust.hpp"
#include "marrow/base/framework_file.hpp"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <optional>

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;
constexpr const char* kTrustAll = "MARROW_TRUST_ALL_PLUGINS";
constexpr std::size_t kMostNames_bytes = 1 << 20;  // for the names of a group's members

/// Whether a group is the owner's private group. Most systems make one for each user, and programs of developers let it
/// write (umask 002).
bool is_private(gid_t id, uid_t owner) {
  const std::optional<User> user = user_of(owner);
  if (!user) return id == owner || (owner == geteuid() && id == getegid());
  if (id != user->group) return false;
  std::vector<char> buffer(1 << 12);
  group entry{}, *found = nullptr;
  while (getgrgid_r(id, &entry, buffer.data(), buffer.size(), &found) == ERANGE && buffer.size() < kMostNames_bytes)
    buffer.resize(4 * buffer.size());
  if (!found || found->gr_name != user->name) return false;
  for (char** member = found->gr_mem; *member; ++member)
    if (*member != user->name) return false;
  return true;
}

uid_t owner_of_framework() {
  static const uid_t owner = [] {
    struct stat status {};
    return stat(framework_file().c_str(), &status) == 0 ? status.st_uid : 0;
  }();
  return owner;
}

std::string mode_text(mode_t mode) { return formatted("{:04o}", mode & 07777); }

/// Whether a file has an access list. If so, the group's bits of the mode say what the users of the list may do at
/// most. They say nothing about the group itself.
bool has_access_list(const fs::path& path) { return getxattr(path.c_str(), "system.posix_acl_access", nullptr, 0) > 0; }

/// What lets others change a file or the entries of a folder; empty if nothing does. In a folder above, a sticky bit
/// keeps others from replacing files that they do not own.
std::string fault_of(const fs::path& path, bool is_above, uid_t also) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return "cannot be read: " + std::string(std::strerror(errno));
  const std::string quoted = "'" + path.string() + "'";
  if (status.st_uid != geteuid() && status.st_uid != 0 && status.st_uid != owner_of_framework() &&
      status.st_uid != also)
    return "is not trusted, because " + quoted + " belongs to " + user_name(status.st_uid) + " (mode " +
           mode_text(status.st_mode) + "), who is neither you nor root; copy it into a folder of your own";
  if (is_above && (status.st_mode & S_ISVTX)) return "";
  const bool has_list = (status.st_mode & S_IWGRP) && has_access_list(path);
  const bool group = has_list || ((status.st_mode & S_IWGRP) && !is_private(status.st_gid, status.st_uid));
  if (!group && !(status.st_mode & S_IWOTH)) return "";
  // A folder with a sticky bit is for all users, as /tmp is.
  const bool is_for_all = S_ISDIR(status.st_mode) && (status.st_mode & S_ISVTX);
  return "is not trusted, because others may write to " + quoted + " (owner " + user_name(status.st_uid) + ", mode " +
         mode_text(status.st_mode) + (has_list ? " and an access list" : "") + "); " +
         (is_for_all ? "move the library into a folder of your own" : "chmod go-w " + quoted);
}

/// Whether a folder contains marrow itself. Whoever can write there can replace marrow, so it would not help to
/// distrust the plugins below.
bool holds_framework(const fs::path& folder) {
  static const fs::path framework = framework_file();
  return std::mismatch(folder.begin(), folder.end(), framework.begin(), framework.end()).first == folder.end();
}

/// Checks a folder, given without links, and all folders above it.
std::string fault_of_folders(fs::path folder, bool is_above, uid_t also) {
  std::string fault;
  for (bool is_last = false; fault.empty() && !is_last; is_above = true, folder = folder.parent_path()) {
    if (!holds_framework(folder)) fault = fault_of(folder, is_above, also);
    is_last = folder == folder.parent_path();
  }
  return fault;
}

/// Checks a path without links: a file or folder, and all folders above it.
std::string fault_of_chain(const fs::path& real, uid_t also) {
  std::string fault = fault_of(real, false, also);
  if (fault.empty()) fault = fault_of_folders(real.parent_path(), fs::is_directory(real), also);
  return fault;
}

/// Checks a path that may contain links. Sets `real` to the path without links.
std::string fault_of_both_ends(const fs::path& file, fs::path& real, uid_t also = 0) {
  std::error_code error;
  real = fs::canonical(file, error);
  if (error) return "cannot be read: " + error.message();
  const fs::path folder = fs::canonical(fs::absolute(file).parent_path(), error);
  if (error) return "cannot be read: " + error.message();
  std::string fault = fault_of_chain(real, also);
  if (fault.empty() && real.parent_path() != folder) fault = fault_of_chain(folder, also);
  return fault;
}

std::string with_way_out(const std::string& fault) {
  return fault + (fault.starts_with("is not") ? std::string(", or set ") + kTrustAll + "=1" : "");
}

}  // namespace

bool all_are_trusted() {
  const char* all = std::getenv(kTrustAll);
  return all && std::strcmp(all, "1") == 0;
}

bool is_still_trusted(const TrustedFiles& files) {
  return all_are_trusted() ||
         (std::all_of(files.folders.begin(), files.folders.end(),
                      [](const std::string& folder) { return fault_of_folders(folder, false, 0).empty(); }) &&
          std::all_of(files.groups.begin(), files.groups.end(),
                      [](const auto& group) { return is_private(group[0], group[1]); }));
}

bool TrustedFiles::add(const fs::path& file) {
  fs::path real;
  struct stat status {};
  if (all_are_trusted()) return true;
  if (!fault_of_both_ends(file, real).empty() || stat(real.c_str(), &status) != 0) return false;
  folders.insert(real.parent_path().string());
  folders.insert(fs::canonical(fs::absolute(file).parent_path()).string());
  if (status.st_mode & S_IWGRP) groups.insert({status.st_gid, status.st_uid});
  return true;
}

std::string changeable_by_others(const fs::path& file) {
  fs::path real;
  return fault_of_both_ends(file, real);
}

fs::path trusted_path(const fs::path& library) {
  fs::path real;
  const std::string fault = fault_of_both_ends(library, real);
  if (all_are_trusted()) return real.empty() ? library : real;
  if (!fault.empty()) throw Error(with_way_out(fault));
  return real;
}

std::string untrusted_among(const std::vector<fs::path>& files, uid_t also) {
  if (all_are_trusted()) return "";
  for (const fs::path& file : files) {
    std::error_code error;
    if (is_of_the_system(file.string()) || !fs::exists(file, error)) continue;
    fs::path real = fs::canonical(file, error);
    if (holds_framework(real)) continue;  // it is marrow's own library
    if (const std::string fault = fault_of_both_ends(file, real, also); !fault.empty())
      return "cannot be loaded, because it needs '" + file.string() + "', which " + with_way_out(fault);
  }
  return "";
}

}  // namespace marrow
