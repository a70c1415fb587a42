// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>
#include <functional>

namespace marrow {

using Clock = std::chrono::steady_clock;

inline double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Reports that a wait for another process has begun, that it is long, and that it has ended: Store::claim() says when.
class Waiting {
 public:
  explicit Waiting(const std::function<void(bool)>& on_wait) : on_wait_(on_wait) {}
  ~Waiting() {
    if (said_) on_wait_(false);
  }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;

  void goes_on() {
    const auto waited = Clock::now() - start_;
    if (!on_wait_ || waited < (said_ == 0 ? Clock::duration(kAtOnce) : Clock::duration(kLong)) || said_ == 2) return;
    ++said_;
    on_wait_(true);
  }

 private:
  static constexpr auto kAtOnce = std::chrono::milliseconds(100);  // shorter waits are not reported
  static constexpr auto kLong = std::chrono::seconds(5);           // longer waits are shown to people

  const std::function<void(bool)>& on_wait_;
  Clock::time_point start_ = Clock::now();
  int said_ = 0;
};

}  // namespace marrow
