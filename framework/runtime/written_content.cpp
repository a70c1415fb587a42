// SPDX-License-Identifier: Apache-2.0
#include "written_content.hpp"

#include "marrow/runtime/library.hpp"
#include "named_files.hpp"

namespace marrow {

Digest content_of(const std::filesystem::path& path) {
  Hasher hasher;
  for (const NamedFile& file : files_named_by(path)) {
    hasher.add(file.name);
    hasher.add(file.is_there ? file_digest(file.file) : Digest{});
  }
  return hasher.digest();
}

}  // namespace marrow
