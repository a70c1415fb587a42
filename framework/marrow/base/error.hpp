// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <stdexcept>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A node throws this if its input, a file or an option cannot be used. The text is for people. It says what is wrong,
/// what was found and expected, and what to do. The runtime adds the node's name and its inputs.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by Context::check_cancelled() after Ctrl-C. Nodes must let it pass.
class Cancelled : public std::exception {
 public:
  const char* what() const noexcept override { return "cancelled"; }
};

/// The message of the exception that is being handled. Plugins may throw anything: the type is named if it is not a
/// std::exception.
std::string reason_of_exception();

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
