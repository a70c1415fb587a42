// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow::cli {

/// The line for a shell that replays a failed call under a debugger.
std::string debugger_line(const std::string& debugger, const std::filesystem::path& folder);

/// Replaces this process by the debugger, which replays the call. gdb and lldb stop right before it; any other program
/// gets the command as its arguments. Throws Error if the debugger cannot be started.
[[noreturn]] void start_under_debugger(const std::string& debugger, const std::filesystem::path& folder);

}  // namespace marrow::cli
