// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>
#include <time.h>

#include <filesystem>
#include <optional>

#include "marrow/base/export.hpp"
#include "marrow/base/hash.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {

/// What distinguishes two states of a file. A write changes the time of the file's last change, which no program can
/// set. If the file is mapped into memory, only the first write after write_back() changes it.
struct FileState {
  dev_t device = 0;
  ino_t number = 0;
  off_t size = 0;
  timespec written{}, changed{};
  bool operator==(const FileState& other) const;
  void add_to(Hasher& hasher) const;
};

/// Nothing if the file is not there.
std::optional<FileState> state_of(const std::filesystem::path& file);

/// Whether every later change of the file will show in its state. Ask before reading the file. A file that was changed
/// just now may change again within the resolution of its time, which is at most 2 s. The clock of a network file
/// system may differ from this host's by minutes. There the file must have been in this state for 10 minutes, or for
/// 2 s since this process first asked. A file that exists only in memory may change without a new time.
bool is_settled(const std::filesystem::path& file, const FileState& state);

}  // namespace marrow
