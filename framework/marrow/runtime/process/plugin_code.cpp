// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/plugin_code.hpp"

#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <vector>

namespace marrow {

/// All code of plugins that runs in this process.
class RunningCode {
 public:
  /// It is never destroyed: the process may end on any thread.
  static RunningCode& all() {
    static RunningCode* const all = new RunningCode;
    return *all;
  }
  /// nullptr if no code of a plugin has run.
  static RunningCode* if_any() { return made_; }
  void add(PluginCode* code) {
    const std::scoped_lock lock(mutex_);
    process_ = getpid();
    running_.push_back(code);
  }
  void remove(PluginCode* code) {
    const std::scoped_lock lock(mutex_);
    std::erase(running_, code);
  }
  void leave_ends_to_parent() { is_left_to_parent_ = true; }

  /// Whether code of a plugin ends the process on this thread. If so, says it.
  bool ends_process() {
    if (is_left_to_parent_ || process_ != getpid()) return false;  // after a fork, no thread would unlock the mutex
    std::unique_lock lock(mutex_);
    const auto own = std::find_if(running_.begin(), running_.end(),
                                  [](const PluginCode* code) { return code->thread_ == std::this_thread::get_id(); });
    if (running_.empty()) return false;
    // The main thread may end the program. On another thread, only a plugin can be the cause.
    if (own == running_.end() && gettid() == getpid()) return false;
    const PluginCode* code = own != running_.end() ? *own : running_.size() == 1 ? running_[0] : nullptr;
    lock.unlock();
    if (code && code->on_end_) code->on_end_("it ended the process; a node must return or throw an exception");
    std::fprintf(stderr, "marrow: error: %s ended the process; its exit code is %d\n",
                 code ? code->what_.c_str() : "one of several nodes that ran", kEndedByPlugin);
    return true;
  }

 private:
  RunningCode() {
    made_ = this;
    std::atexit(check_end);
    std::at_quick_exit(check_end);
  }
  static void check_end() {
    if (all().ends_process()) end_process(kEndedByPlugin);
  }

  static inline std::atomic<RunningCode*> made_{nullptr};

  std::mutex mutex_;
  std::vector<PluginCode*> running_;
  std::atomic<pid_t> process_{0};
  std::atomic<bool> is_left_to_parent_{false};
};

PluginCode::PluginCode(std::string what, std::function<void(const std::string& reason)> on_end)
    : what_(std::move(what)), on_end_(std::move(on_end)) {
  RunningCode::all().add(this);
}
PluginCode::~PluginCode() { RunningCode::all().remove(this); }

int code_of_end(int code) {
  RunningCode* running = RunningCode::if_any();
  return running && running->ends_process() ? kEndedByPlugin : code;
}

void leave_ends_to_parent() { RunningCode::all().leave_ends_to_parent(); }

void end_process(int code) {
  syscall(SYS_exit_group, code);
  std::abort();  // not reached
}

}  // namespace marrow
