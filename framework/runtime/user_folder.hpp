// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow {

/// The folder for what a program can make again: XDG_CACHE_HOME, or .cache in HOME or in the home that the system knows
/// of the user. A variable that is empty or names no absolute path counts as not set. Empty where there is none; never
/// a folder that all users share.
std::filesystem::path user_cache_folder();

/// "alice", or "user 1001" for one without a name.
std::string user_name(unsigned user);

}  // namespace marrow
