// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/file_state.hpp"

#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>

#include <algorithm>
#include <array>
#include <map>
#include <mutex>

#include "marrow/base/stopwatch.hpp"

namespace marrow {
namespace {

constexpr time_t kResolution_s = 2, kOtherClocks_s = 600;

/// Whether a file system is on a disk of this host. Its times then come from this host's clock.
bool is_local(long kind) {
  constexpr std::array<long, 6> kLocal{EXT4_SUPER_MAGIC, XFS_SUPER_MAGIC,       BTRFS_SUPER_MAGIC,
                                       F2FS_SUPER_MAGIC, OVERLAYFS_SUPER_MAGIC, 0x2fc12fc1 /* ZFS */};
  return std::find(kLocal.begin(), kLocal.end(), kind) != kLocal.end();
}

/// Whether this process has seen the file in this state for longer than the resolution of its time, by its own clock.
bool was_seen(const std::filesystem::path& file, const FileState& state) {
  struct Seen {
    FileState state;
    Clock::time_point since;
  };
  static std::mutex mutex;
  static std::map<std::filesystem::path, Seen> seen;
  const std::scoped_lock lock(mutex);
  const auto [known, is_new] = seen.try_emplace(file, Seen{state, Clock::now()});
  if (!is_new && !(known->second.state == state)) known->second = {state, Clock::now()};
  return seconds_since(known->second.since) > kResolution_s;
}

}  // namespace

bool FileState::operator==(const FileState& other) const {
  const auto same = [](const timespec& a, const timespec& b) { return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec; };
  return device == other.device && number == other.number && size == other.size && same(written, other.written) &&
         same(changed, other.changed);
}

void FileState::add_to(Hasher& hasher) const {
  hasher.add(std::uint64_t(device));
  hasher.add(std::uint64_t(number));
  hasher.add(std::int64_t(size));
  for (const timespec& time : {written, changed}) {
    hasher.add(std::int64_t(time.tv_sec));
    hasher.add(std::int64_t(time.tv_nsec));
  }
}

std::optional<FileState> state_of(const std::filesystem::path& file) {
  struct stat status {};
  if (stat(file.c_str(), &status) != 0) return std::nullopt;
  return FileState{status.st_dev, status.st_ino, status.st_size, status.st_mtim, status.st_ctim};
}

bool is_settled(const std::filesystem::path& file, const FileState& state) {
  struct statfs system {};
  if (statfs(file.c_str(), &system) != 0 || system.f_type == TMPFS_MAGIC || system.f_type == RAMFS_MAGIC) return false;
  const time_t age_s = time(nullptr) - state.changed.tv_sec;
  if (is_local(system.f_type)) return age_s > kResolution_s;
  return age_s > kOtherClocks_s || was_seen(file, state);
}

}  // namespace marrow
