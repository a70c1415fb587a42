// SPDX-License-Identifier: Apache-2.0
#pragma once
// What happens if code of a plugin ends the process (exit, quick_exit, _exit) instead of returning: nobody must take
// that for a program that has done its work.
#include <functional>
#include <string>
#include <thread>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// The exit code of a process that code of a plugin ended: EX_SOFTWARE of sysexits.h.
inline constexpr int kEndedByPlugin = 70;

/// Lives as long as code of a plugin runs on this thread. If that ends the process, on_end(reason) is called on the
/// thread that does so, the standard error says that it was `what`, and the exit code is kEndedByPlugin.
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

/// To be called on a thread that ends the process with `code`. If code of a plugin does that, says so and returns
/// kEndedByPlugin, otherwise `code`. A process that was forked ends as it likes.
int code_of_end(int code);

/// From now on, code of plugins may end this process: another process waits for it and takes any end for a failure.
void leave_ends_to_parent();

/// Ends the process at once, also where code of a plugin runs.
[[noreturn]] void end_process(int code);

}  // namespace marrow
