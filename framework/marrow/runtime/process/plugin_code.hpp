// SPDX-License-Identifier: Apache-2.0
#pragma once
// Handles plugin code that ends the process (exit, quick_exit, _exit) instead of returning: nobody must mistake this
// for a program that has finished its work.
#include <functional>
#include <string>
#include <thread>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The exit code of a process that code of a plugin ended: EX_SOFTWARE of sysexits.h.
inline constexpr int kEndedByPlugin = 70;

/// Lives as long as code of a plugin runs on this thread. If this code ends the process, on_end(reason) is called on
/// the thread that ends it, the standard error names `what`, and the exit code is kEndedByPlugin.
class PluginCode {
 public:
  explicit PluginCode(std::string what, std::function<void(const std::string& reason)> on_end = nullptr);
  ~PluginCode();
  PluginCode(const PluginCode&) = delete;
  PluginCode& operator=(const PluginCode&) = delete;

 private:
  friend class RunningCode;

  std::string what_;
  std::function<void(const std::string&)> on_end_;
  std::thread::id thread_ = std::this_thread::get_id();
};

/// Call it on a thread that is about to end the process with `code`. If code of a plugin is the cause, says so and
/// returns kEndedByPlugin. Otherwise, and in a forked process, returns `code`.
int code_of_end(int code);

/// From now on, code of plugins may end this process: another process waits for it and takes any end for a failure.
void leave_ends_to_parent();

/// Ends the process at once, even if code of a plugin runs.
[[noreturn]] void end_process(int code);

}  // namespace marrow
