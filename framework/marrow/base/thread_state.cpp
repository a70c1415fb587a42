// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/thread_state.hpp"

#include <limits>
#include <opencv2/core.hpp>

namespace marrow {
namespace {

/// Whether results or operands that are too small for full precision become 0. The library of compilers sets this when
/// a program or a library that was linked with -ffast-math starts.
bool flushes_tiny_numbers() {
  volatile double smallest = std::numeric_limits<double>::min(), tiny = std::numeric_limits<double>::denorm_min();
  const volatile double half = smallest / 2, product = tiny * 4503599627370496.0;  // 2^52: the smallest normal number
  return half == 0 || product == 0;
}

std::string unusual_arithmetic() {
  if (fegetround() != FE_TONEAREST) return "the rounding of numbers";
  if (flushes_tiny_numbers()) return "the treatment of tiny numbers (-ffast-math makes them 0)";
  if (fegetexcept() != 0) return "the trapping of faults in calculations";
  return "";
}

bool same_signals(const sigset_t& one, const sigset_t& other) {
  for (int signal = 1; signal < SIGRTMIN; ++signal)
    if (sigismember(&one, signal) != sigismember(&other, signal)) return false;
  return true;
}

}  // namespace

UsualArithmetic::UsualArithmetic() {
  fegetenv(&before_);
  fesetenv(FE_DFL_ENV);
}

UsualArithmetic::~UsualArithmetic() { fesetenv(&before_); }

ThreadState::ThreadState() : locale_(uselocale(nullptr)) {
  fesetenv(FE_DFL_ENV);
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked_);
  cv::theRNG() = cv::RNG();
}

std::string ThreadState::put_back() const {
  std::string changed = unusual_arithmetic();
  fesetenv(FE_DFL_ENV);
  if (uselocale(nullptr) != locale_) {
    if (changed.empty()) changed = "the locale of its thread";
    uselocale(locale_);
  }
  sigset_t blocked;
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  if (!same_signals(blocked, blocked_)) {
    if (changed.empty()) changed = "the set of signals that its thread blocks";
    pthread_sigmask(SIG_SETMASK, &blocked_, nullptr);
  }
  return changed;
}

}  // namespace marrow
