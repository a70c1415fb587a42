// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/temporary_folder.hpp"

#include <cerrno>
#include <cstdlib>
#include <cstring>

#include "marrow/base/error.hpp"

namespace marrow {

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::filesystem::path new_temporary_folder(const std::string& purpose) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path();
  std::string name = (folder / ("marrow-" + purpose + "-XXXXXX")).string();
  if (!mkdtemp(name.data()))
    throw Error("cannot make a temporary folder in " + folder.string() + ": " + std::strerror(errno) +
                "; name another one in TMPDIR");
  return name;
}

}  // namespace marrow
