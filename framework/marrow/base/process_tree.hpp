// SPDX-License-Identifier: Apache-2.0
#pragma once
// A process and all that it started; and who a process is, so that one of another host can tell it from all others.
#include <sys/types.h>

#include <spawn.h>
#include <string>
#include <string_view>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// From now on, a descendant of this process whose parent ends becomes a child of this process. So whatever this
/// process starts stays in its tree.
void keep_descendants();

/// All processes that a process started, directly or through others, and that have not ended.
std::vector<pid_t> descendants_of(pid_t process);

/// Kills a process, its group, and all that it started, including what left the group. Call it before waiting for the
/// process: until then, no other process or group has its number.
void kill_tree(pid_t process);

/// Resident memory of a process and its descendants. If the plain sum exceeds `enough_mb`, shared memory is
/// counted only once, as far as the system reports it; this takes longer.
double memory_of_tree_mb(pid_t process, double enough_mb);

/// Resident memory of this process, in units of 1e6 bytes. Allocates nothing, because it is called when there may be no
/// memory left.
double resident_memory_mb();

/// The identity of this process: its host, the boot of the host, the namespaces of process numbers and of times, its
/// number and its start. It is a part of file names, so it has letters, digits and dots only. Those of one host sort by
/// process. For example node07.9f86d081884c7d65.00012345.000001234567.
const std::string& this_process();

/// Whether a text has the form of an identity.
bool is_identity(std::string_view text);

enum class Life { lives, ended, unknown };
/// Whether the process of an identity lives. The system is asked only about processes of this host, boot and namespace:
/// elsewhere the same number means another process. All others are unknown, and so is a text that is not an identity.
Life life_of(std::string_view identity);

/// Attributes with which a child starts: default handling of signals, none of them blocked, and a process group of its
/// own, so that Ctrl-C reaches only this process, which then ends the child.
class SpawnAttributes {
 public:
  SpawnAttributes();
  ~SpawnAttributes() { posix_spawnattr_destroy(&attributes_); }
  SpawnAttributes(const SpawnAttributes&) = delete;
  SpawnAttributes& operator=(const SpawnAttributes&) = delete;
  const posix_spawnattr_t* get() const { return &attributes_; }

 private:
  posix_spawnattr_t attributes_;
};

}  // namespace marrow
