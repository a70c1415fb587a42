// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <sys/types.h>

#include <string>

#include "marrow/base/descriptor.hpp"

namespace marrow {

/// The working folder of this process, at which all relative paths start. A plugin's library may change it. Then inputs
/// would be read and results written in the wrong place. Safe to use from several threads.
class WorkingFolder {
 public:
  WorkingFolder();

  /// Goes back to the folder in which the process was when this object was made. Returns the folder in which it was;
  /// empty if it had not changed.
  std::string go_back() const;

 private:
  Descriptor descriptor_;
  dev_t device_ = 0;
  ino_t number_ = 0;
};

}  // namespace marrow
