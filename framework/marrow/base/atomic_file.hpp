// SPDX-License-Identifier: Apache-2.0
#pragma once
// How marrow writes files that are whole or not there: under a temporary name, and then renamed.
#include <filesystem>
#include <functional>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A temporary name for a file or folder that is renamed to `final` when it is complete: FINAL.tmp-PROCESS-NUMBER. It
/// tells a clean-up what the file was to become and who writes it. Each call returns a new name.
std::filesystem::path temporary_beside(const std::filesystem::path& final);
/// The same for a folder that people look into: .tmp-PROCESS-NUMBER, hidden, and short however long the final name is.
std::filesystem::path hidden_beside(const std::filesystem::path& final);
/// Whether a name may be one of hidden_beside().
bool is_hidden_temporary(const std::filesystem::path& file);

/// A new file that replaces `final` when it is finished. Until then no reader and no second writer sees it; if it is
/// not finished, nothing is left behind and the old file stays. A link is replaced, not followed.
class AtomicFile {
 public:
  using NameBeside = std::filesystem::path (*)(const std::filesystem::path& final);
  /// Opens a file that must not be there yet. Returns -1 with errno if it cannot.
  using OpenNew = std::function<int(const std::filesystem::path&)>;

  AtomicFile(std::filesystem::path final, NameBeside name_beside, const OpenNew& open_new);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Its errno is set if the file is not open.
  const Descriptor& descriptor() const { return descriptor_; }
  /// Puts the file in its place. If `is_durable`, waits until it is on the disk. Returns false, with errno, if that is
  /// not possible.
  bool finish(bool is_durable = false);

 private:
  std::filesystem::path final_, temporary_;
  Descriptor descriptor_;
};

}  // namespace marrow
