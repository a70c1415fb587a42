// SPDX-License-Identifier: Apache-2.0
#pragma once
// A process and all that it started.
#include <sys/types.h>

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

}  // namespace marrow
