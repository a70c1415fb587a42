// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <mutex>
#include <set>
#include <string>

#include "marrow/runtime/run/executor.hpp"

namespace marrow::cli {

/// Keeps the text that Ctrl-C shows (say_when_stopped): what a run still waits for, and how to end it at once.
class StopNotice {
 public:
  StopNotice() = default;
  ~StopNotice();
  StopNotice(const StopNotice&) = delete;
  StopNotice& operator=(const StopNotice&) = delete;

  /// To be told of all events of the run. Safe to use from several threads.
  void operator()(const RunEvent& event);

 private:
  std::mutex mutex_;
  std::multiset<std::string> running_;
};

}  // namespace marrow::cli
