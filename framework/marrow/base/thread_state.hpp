// SPDX-License-Identifier: Apache-2.0
#pragma once
// The state of a single thread, which one node could leave changed for the next node on the same thread.
#include <fenv.h>
#include <locale.h>
#include <signal.h>

#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// While it lives, this thread calculates with the default settings: it rounds to nearest, keeps tiny numbers and traps
/// nothing. Afterwards its earlier settings hold again.
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
