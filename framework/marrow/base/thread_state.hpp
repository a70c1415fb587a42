// SPDX-License-Identifier: Apache-2.0
#pragma once
// What each thread has for itself, and what a node that runs on it could leave behind for the next one.
#include <fenv.h>
#include <locale.h>
#include <signal.h>

#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// As long as it lives, this thread calculates with numbers as every program does that changes nothing: rounding to
/// nearest, tiny numbers are kept, nothing traps. Afterwards it calculates as it did before.
class UsualArithmetic {
 public:
  UsualArithmetic();
  ~UsualArithmetic();
  UsualArithmetic(const UsualArithmetic&) = delete;
  UsualArithmetic& operator=(const UsualArithmetic&) = delete;

 private:
  fenv_t before_;
};

/// The state of a thread of the pool, on which a node is called. A call begins with usual arithmetic and with OpenCV's
/// random numbers at their start, whatever ran there before.
class ThreadState {
 public:
  ThreadState();
  /// Puts back what has changed. Returns what that was, or an empty text.
  std::string put_back() const;

 private:
  locale_t locale_;
  sigset_t blocked_;
};

}  // namespace marrow
