// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace marrow {

/// Who could change a file or folder, or put another in its place: nobody but the user, root and the owner of marrow's
/// own library, who could change that as well? Empty when so; else a sentence that names the folder or file, its owner
/// and mode, and the cure. Both ends of a link count, and the folders above up to one that holds marrow itself. A group
/// may write where it is the owner's private one.
std::string changeable_by_others(const std::filesystem::path& file);

/// The path of a library without links. Only this one may be opened: a link on the way of the given one may lie where
/// others can turn it to another place. Throws Error for a library that others could change, unless
/// MARROW_TRUST_ALL_PLUGINS is 1.
std::filesystem::path trusted_path(const std::filesystem::path& library);

}  // namespace marrow
