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

}  // namespace marrow
