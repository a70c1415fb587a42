// SPDX-License-Identifier: Apache-2.0
#pragma once
// What all nodes of a process share besides their inputs, and could change for the others without a trace in any key:
// the working folder, the locale, the handlers of signals, and on each thread the arithmetic and the blocked signals.
// After each call they are compared with what they were. The rest is the plugin's duty (docs/plugins.md).
#include <fenv.h>
#include <locale.h>
#include <signal.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
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

/// The state of the thread on which a node is called. A call begins with usual arithmetic and with OpenCV's random
/// numbers at their start, whatever ran there before.
class ThreadState {
 public:
  ThreadState();
  /// Puts back what has changed. Returns what that was, or an empty text.
  std::string put_back() const;

 private:
  locale_t locale_;
  sigset_t blocked_{};
};

/// The state of this process as it must stay while nodes run. Safe to use from several threads.
class ProcessState {
 public:
  /// The state that all current runs in this process share: the state at the beginning of the first of them.
  static std::shared_ptr<ProcessState> of_runs();

  ProcessState();
  ~ProcessState();

  /// Calls plugin code. If the state changes meanwhile, puts it back and throws Error with what was changed. So do
  /// calls on other threads that ran at the same time: their results may be wrong. Passes on exceptions of the code.
  void keep_during(const std::function<void()>& code);

  /// Puts back what has changed. Returns what that was, in words; an empty text if nothing has.
  std::string put_back();

 private:
  struct Parts;

  const std::unique_ptr<Parts> parts_;
  std::mutex mutex_;
  std::atomic<long> changes_{0};  ///< how often something had to be put back
  std::string last_change_;
};

}  // namespace marrow
