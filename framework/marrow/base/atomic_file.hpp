// SPDX-License-Identifier: Apache-2.0
#pragma once
// How marrow writes files so that they are either complete or absent: under a temporary name, and then renamed.
#include <filesystem>
#include <functional>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A temporary name for a file or folder that is renamed to `final` when it is complete: FINAL.tmp-PROCESS-NUMBER. It
/// shows a clean-up the final name and the writer. Each call returns a new name.
std::filesystem::path temporary_beside(const std::filesystem::path& final);
/// The same for a folder that people look into: .tmp-PROCESS-NUMBER, hidden, and short even if the final name is long.
std::filesystem::path hidden_beside(const std::filesystem::path& final);
/// Whether a name may be one of hidden_beside().
bool is_hidden_temporary(const std::filesystem::path& file);

/// A new file that replaces `final` when it is finished. Until then no reader and no second writer sees it; if it is
/// not finished, nothing is left behind and the old file stays. A link is replaced, not followed.
class AtomicFile {
 public:
  using NameBeside = std::filesystem::path (*)(const std::filesystem::path& final);
  /// Opens a file that must not exist yet. Returns -1 with errno if it cannot.
  using OpenNew = std::function<int(const std::filesystem::path&)>;

  AtomicFile(std::filesystem::path final, NameBeside name_beside, const OpenNew& open_new);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// If it is not open, errno says why.
  const Descriptor& descriptor() const { return descriptor_; }
  /// Renames the file to its final name. If `is_durable`, first waits until it is on the disk. Returns false, with
  /// errno, if that fails.
  bool finish(bool is_durable = false);

 private:
  std::filesystem::path final_, temporary_;
  Descriptor descriptor_;
};

}  // namespace marrow
