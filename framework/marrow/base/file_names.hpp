// SPDX-License-Identifier: Apache-2.0
#pragma once
// Names that people choose and that become names of files and folders.
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/base/diagnostics.hpp"

namespace MARROW_EXPORT marrow {

inline constexpr const char* kNameHint =
    "use at most 100 letters, digits, '-', '_', '.' and spaces, and begin with neither a dot nor a space";

/// Why a text cannot be the name of a file or folder on every machine, as "it holds '/'"; empty if it can. A good name
/// has 1 to 100 bytes of UTF-8 without '/', '\' and what odd_character_in() finds. It does not begin with a dot or a
/// space and does not end with a space.
std::string fault_of_name(const std::string& name);

/// Reports a fault at `place` if a text cannot be the name of a file. `what` says what is named ("a pipeline's name").
void check_file_name(Diagnostics& diagnostics, const Place& place, const std::string& name, const std::string& what);

/// A file name for any text. Different texts get different names. Characters that a name cannot have, and '%' and '~',
/// are written as in %2F. A name of more than 200 bytes is cut and ends with a hash of the whole text.
std::string file_name_of(const std::string& text);

/// The names of a list's items, made distinct: a name that was there before gets (2), (3) and so on.
std::vector<std::string> distinct_names(const std::vector<std::string>& names);

/// The path without '.', and without '..' if this does not change its meaning. A '..' is removed together with the
/// folder before it, if that folder exists and is not a link. After a link, '..' stays, because the system goes up from
/// the target of the link.
std::filesystem::path plain_path(const std::filesystem::path& path);

}  // namespace marrow
