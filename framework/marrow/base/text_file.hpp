// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads whole text files with a limit of their size. Writes them so that a file is never half written.
#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>

#include "marrow/base/descriptor.hpp"

namespace MARROW_EXPORT marrow {

inline constexpr std::uintmax_t kMostSourceBytes = 4'000'000;    ///< limit for a file that people write
inline constexpr std::uintmax_t kMostRecordBytes = 256'000'000;  ///< limit for a file that marrow wrote

/// Throws Error if the file cannot be read, is longer than `most_bytes` or is not a regular file. The reader of a pipe
/// may wait for ever, and opening a device may have an effect.
std::string read_text_file(const std::filesystem::path& file, std::uintmax_t most_bytes);

/// A file that a command was given. "-" is the standard input, which is read once; as a file, "-" is given as ./-.
/// Throws Error as read_text_file() does.
std::string read_given_text(const std::filesystem::path& file, std::uintmax_t most_bytes);

enum class Kinds { files, files_and_pipes };

/// Writes a temporary file next to `file` and renames it. If the disk is full or the process is killed, the old file
/// stays, or there is none. A link is replaced. A pipe or device is replaced too, unless `kinds` includes pipes. A user
/// who names a pipe, or a link to one, as the place of a result wants it to be used. But a pipe among marrow's own
/// files would only make the writer wait. `mode` is that of open(). Throws Error if the file cannot be written.
void write_text_file(const std::filesystem::path& file, const std::string& text, Kinds kinds = Kinds::files,
                     mode_t mode = 0666);

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
