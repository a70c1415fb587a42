// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow {

/// The folder for files that a program can make again: XDG_CACHE_HOME, or .cache in HOME, or .cache in the home folder
/// that the system knows for the user. A variable that is empty or not an absolute path counts as not set. Empty if
/// there is none of these. It is never a folder that all users share.
std::filesystem::path user_cache_folder();

/// The name of a user, "alice"; or "user 1001" if the system knows no name.
std::string user_name(unsigned user);

}  // namespace marrow
