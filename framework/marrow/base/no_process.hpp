// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/base/error.hpp"
#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Thrown if the system does not start another process or thread, for example because of a limit. This is a fault of
/// the environment and not of a node.
class NoProcess : public Error {
 public:
  using Error::Error;
};

/// How often a call of a node, or a whole run, failed for this reason in this process. A comparison must not count this
/// as a failure of a method.
long calls_without_process();
void note_call_without_process();

}  // namespace marrow
