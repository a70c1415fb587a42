// SPDX-License-Identifier: Apache-2.0
#pragma once
// What all nodes of a process share besides their inputs: the working folder, the locale, the environment, the handlers
// of signals, the standard streams, limits, the mask of new files' permissions, and OpenCV's settings. A node that
// changed it would change the results of other nodes, and their keys would not show it.
#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <string>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The state of this process as it must stay while nodes run. Safe to use from several threads.
class ProcessState {
 public:
  /// The state that all current runs in this process share: the state at the beginning of the first of them.
  static std::shared_ptr<ProcessState> of_runs();

  ProcessState();
  ~ProcessState();
  ProcessState(const ProcessState&) = delete;
  ProcessState& operator=(const ProcessState&) = delete;

  /// From now on OpenCV's loops stay on the thread that calls them, and OpenCV uses all instructions of the processor.
  /// Both are part of the state.
  void set_up_opencv();

  /// Calls plugin code. If the state changes meanwhile, puts it back and calls the code once more, now alone, because
  /// other code may have changed the state. Throws Error, with what was changed, if it changes again. Passes on
  /// exceptions of the code.
  void keep_during(const std::function<void()>& code);

  /// Calls code that starts a process, which inherits the state. If the state changes meanwhile, puts it back and calls
  /// the code again. Calls of plugin code may contain such calls.
  void keep_for_process(const std::function<void()>& start);

  /// Puts back what has changed. Returns what that was, in words; an empty text if nothing has.
  std::string put_back();

 private:
  struct Parts;

  const std::unique_ptr<Parts> parts_;
  std::mutex mutex_;
  std::shared_mutex calls_;       ///< shared by calls that run beside others
  std::atomic<long> changes_{0};  ///< how often something had to be put back
};

}  // namespace marrow
