// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>
#include <filesystem>
#include <optional>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The framework's own shared library, which contains this function.
std::filesystem::path framework_file();

/// The folder for files that a program can make again: XDG_CACHE_HOME, or .cache in HOME, or .cache in the home folder
/// that the system knows for the user. A variable that is empty or not an absolute path counts as not set. Empty if
/// none of these exists. It is never a folder that all users share.
std::filesystem::path user_cache_folder();

struct User {
  std::string name;            ///< empty if the system knows none
  std::filesystem::path home;  ///< empty if it is not an absolute path
  gid_t group = 0;
};
/// What the system knows about a user, if it knows the user.
std::optional<User> user_of(uid_t id);

/// The name of a user, "alice"; or "user 1001" if the system knows no name.
std::string user_name(uid_t id);

}  // namespace marrow
