// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/resource.h>

#include <csignal>

#include "tests/plugins/read/files.hpp"

namespace marrow::test {

/// While it lives no file can grow beyond `bytes`: to a writer the disk is full.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) : signal_(std::signal(SIGXFSZ, SIG_IGN)) {
    ::getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, signal_);
  }

 private:
  rlimit before_{};
  void (*signal_)(int);
};

/// Expects that a writer that cannot finish names the file in its error, keeps the old file, and leaves nothing else.
/// The result of `write` must need more than `bytes`.
template <class Write>
void expect_full_disk_is_diagnosed(const TemporaryFolder& folder, const std::string& name, rlim_t bytes, Write write) {
  const auto path = folder / name;
  put(path, "what was there before");
  std::string message;
  {
    const FullDisk full(bytes);
    message = message_of([&] { write(path.string()); });
  }
  EXPECT_HAS(message, path.string() + ": cannot be written");
  EXPECT_EQ(message.find(".tmp-"), std::string::npos) << message;
  EXPECT_EQ(bytes_of(path), "what was there before");
  for (const auto& entry : std::filesystem::directory_iterator(folder.path())) EXPECT_EQ(entry.path(), path);
  EXPECT_SAYS(write((folder / "absent" / name).string()), "there is no folder");
}

}  // namespace marrow::test
