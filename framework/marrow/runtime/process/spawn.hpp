// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <spawn.h>

namespace marrow {

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
