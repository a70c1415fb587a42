// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/own_cache.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

#include "marrow/base/error.hpp"
#include "marrow/base/regular_file.hpp"
#include "marrow/base/text_file.hpp"
#include "marrow/base/user_folder.hpp"
#include "marrow/runtime/plugins/trust.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// Whether a folder belongs to the user alone. A folder that an older version made readable for all is made private.
bool is_own(const fs::path& folder) {
  struct stat status {};
  if (stat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != geteuid()) return false;
  if ((status.st_mode & 077) && chmod(folder.c_str(), 0700) != 0) return false;
  return changeable_by_others(folder).empty();
}

/// Makes the folder for the user alone. Nobody else may be able to change the folders above it.
bool make_own(const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder, error)) return is_own(folder);
  const fs::path parent = folder.parent_path();
  if (!fs::exists(parent, error) && !make_own(parent)) return false;
  if (!changeable_by_others(parent).empty()) return false;
  return (mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) && is_own(folder);
}

/// Empty if there is no such folder that belongs to the user alone. `make`: makes it.
fs::path own_cache_folder(bool make) {
  const fs::path cache = user_cache_folder();
  if (cache.empty()) return {};
  const fs::path folder = cache / "marrow" / "libraries";
  return (make ? make_own(folder) : is_own(folder)) ? folder : fs::path();
}

}  // namespace

std::optional<std::string> own_cached_text(const std::string& name, std::size_t most_bytes) try {
  const fs::path folder = own_cache_folder(false);
  if (folder.empty()) return std::nullopt;
  const RegularFile file(folder / name);
  if (file.status().st_uid != geteuid()) return std::nullopt;
  return read_text(file, most_bytes);
} catch (const Error&) {
  return std::nullopt;
}

void keep_in_own_cache(const std::string& name, const std::string& text) try {
  if (const fs::path folder = own_cache_folder(true); !folder.empty())
    write_text_file(folder / name, text, Kinds::files, 0600);
} catch (const Error&) {
}

void forget_in_own_cache(const std::string& name) {
  std::error_code error;
  if (const fs::path folder = own_cache_folder(false); !folder.empty()) fs::remove(folder / name, error);
}

}  // namespace marrow
