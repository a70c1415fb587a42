// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <set>
#include <string>
#include <thread>

#include "marrow/runtime/executor.hpp"

namespace marrow::cli {

/// Says, some time after a run was asked to stop, what it still waits for and how to end it at once. A run that stops
/// sooner says nothing.
class StopNotice {
 public:
  explicit StopNotice(const std::atomic<bool>& stopped);
  ~StopNotice();
  StopNotice(const StopNotice&) = delete;
  StopNotice& operator=(const StopNotice&) = delete;

  /// To be told of all events of the run. Safe to use from several threads.
  void operator()(const RunEvent& event);

 private:
  void wait_and_say();

  const std::atomic<bool>& stopped_;
  std::mutex mutex_;
  std::condition_variable end_;
  bool is_over_ = false;
  std::multiset<std::string> running_;
  std::thread thread_;
};

}  // namespace marrow::cli
