// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/error.hpp"

namespace marrow {

/// The system grants no further process or thread, as at a limit: the fault of the surroundings, of no node.
class NoProcess : public Error {
 public:
  using Error::Error;
};

/// How often a call of a node, or a whole run, failed by that in this process. A comparison must not hold it against a
/// method.
long calls_without_process();
void note_call_without_process();

}  // namespace marrow
