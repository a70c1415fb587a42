// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <string>

namespace marrow {

/// The folder that this process works in, from which all relative paths count. A library of a plugin may go elsewhere:
/// then inputs would be read and results be written where nobody asked for it. Safe to use from several threads.
class WorkingFolder {
 public:
  WorkingFolder();
  ~WorkingFolder();
  WorkingFolder(const WorkingFolder&) = delete;
  WorkingFolder& operator=(const WorkingFolder&) = delete;

  /// Goes back to where the process was when this was made. Returns where it had gone; empty where it had not.
  std::string go_back() const;

 private:
  int descriptor_;
  dev_t device_ = 0;
  ino_t number_ = 0;
};

}  // namespace marrow
