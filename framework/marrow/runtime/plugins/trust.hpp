// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Whether others could change a file or folder, or put another in its place. Returns an empty text if only the user,
/// root and the owner of marrow's own library could; that owner could change marrow as well. Else returns a sentence
/// with the name of the folder or file, its owner and mode, and what to do. Both ends of a link count, and so do the
/// folders above, up to one that contains marrow itself. A group may have write access if it is the private group of
/// the owner.
std::string changeable_by_others(const std::filesystem::path& file);

/// The path of a library without links. Only this path may be opened: others may be able to redirect a link in the
/// given path. Throws Error if others could change the library, unless MARROW_TRUST_ALL_PLUGINS is 1.
std::filesystem::path trusted_path(const std::filesystem::path& library);

/// The same rule for files that are loaded together with a plugin: libraries that it links, modules that it imports.
/// Returns a sentence that begins with a verb and names the first file that others could change, or an empty text.
/// Files of the system are not checked: marrow itself needs them. The user `also` is trusted, too: whoever owns the
/// interpreter of Python nodes could change that as well.
std::string untrusted_among(const std::vector<std::filesystem::path>& files, uid_t also = 0);

/// Whether MARROW_TRUST_ALL_PLUGINS is 1.
bool all_are_trusted();

/// What the trust in some files depends on, besides their own owners and modes.
struct TrustedFiles {
  std::set<std::string> folders;                  ///< the folders of both ends of each path, without links
  std::set<std::array<std::uint32_t, 2>> groups;  ///< groups that may write, each with its owner

  /// Returns whether nobody else could change the file.
  bool add(const std::filesystem::path& file);
};
/// Whether nobody else could change the folders, and each group is still the private group of its owner.
bool is_still_trusted(const TrustedFiles& files);

}  // namespace marrow
