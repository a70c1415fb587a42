// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/pipeline/written_content.hpp"

#include "marrow/base/regular_file.hpp"
#include "marrow/runtime/pipeline/named_files.hpp"

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
