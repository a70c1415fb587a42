// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names that people choose and that become names of files and folders.
#include <string>
#include <vector>

#include "marrow/runtime/diagnostics.hpp"

namespace marrow {

inline constexpr const char* kNameHint =
    "use at most 100 letters, digits, '-', '_', '.' and spaces, and begin with neither a dot nor a space";

/// Why a text cannot be the name of a file or folder on any machine, as "it holds '/'"; empty where it can: 1 to 100
/// bytes of UTF-8 without '/', '\' and control characters, that begins neither with a dot nor with a space and ends
/// with no space.
std::string fault_of_name(const std::string& name);

/// A fault at `place` for a text that cannot be the name of a file; `what` says whose it is ("a pipeline's name").
void check_file_name(Diagnostics& diagnostics, const Place& place, const std::string& name, const std::string& what);

/// Any text as the name of a file that no other text has: what a name may not hold, and '%' and '~', is written as %2F.
/// More than 200 bytes end with a hash of the whole instead.
std::string file_name_of(const std::string& text);

/// The names of a list's items, with (2), (3) ... behind those that were there before.
std::vector<std::string> distinct_names(const std::vector<std::string>& names);

}  // namespace marrow
