// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/process_state.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <exception>
#include <filesystem>
#include <limits>
#include <locale>
#include <opencv2/core.hpp>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"

namespace marrow {

/// Named, because ProcessState::Parts, which the header declares, has members of these types.
namespace process_parts {

/// The folder at which all relative paths start. If a plugin's library changed it, inputs would be read and results
/// written in the wrong place.
class WorkingFolder {
 public:
  WorkingFolder() { fstat(descriptor_, &status_); }
  std::string put_back() const {
    struct stat now {};
    if (!descriptor_.is_open() ||
        (stat(".", &now) == 0 && now.st_dev == status_.st_dev && now.st_ino == status_.st_ino))
      return "";
    std::error_code error;
    const std::filesystem::path elsewhere = std::filesystem::current_path(error);
    if (fchdir(descriptor_) != 0) return "";
    return "the working folder was changed to " + (error ? "a folder that is gone" : elsewhere.string());
  }

 private:
  Descriptor descriptor_{open(".", O_PATH | O_DIRECTORY | O_CLOEXEC)};
  struct stat status_ {};
};

/// The locale of C and that of C++, which decide how numbers are written and read.
class Locale {
 public:
  std::string put_back() const {
    const bool is_other = std::locale() != of_streams_, is_other_in_c = setlocale(LC_ALL, nullptr) != of_c_;
    if (!is_other && !is_other_in_c) return "";
    std::locale::global(of_streams_);
    setlocale(LC_ALL, of_c_.c_str());
    return "the locale was changed";
  }

 private:
  const std::locale of_streams_;
  const std::string of_c_ = setlocale(LC_ALL, nullptr);
};

class SignalHandlers {
 public:
  SignalHandlers() {
    for (std::size_t i = 0; i < kUsual.size(); ++i) sigaction(kUsual[i], nullptr, &actions_[i]);
  }
  std::string put_back() const {
    std::string changed;
    for (std::size_t i = 0; i < kUsual.size(); ++i) {
      struct sigaction now {};
      if (sigaction(kUsual[i], nullptr, &now) != 0 || now.sa_sigaction == actions_[i].sa_sigaction) continue;
      sigaction(kUsual[i], &actions_[i], nullptr);
      changed = "the handling of a signal was changed";
    }
    return changed;
  }

 private:
  static constexpr std::array kUsual{SIGHUP,  SIGINT,  SIGQUIT, SIGILL,  SIGABRT, SIGBUS,  SIGFPE, SIGUSR1,
                                     SIGSEGV, SIGUSR2, SIGPIPE, SIGALRM, SIGTERM, SIGCHLD, SIGXFSZ};
  std::array<struct sigaction, kUsual.size()> actions_{};
};

}  // namespace process_parts

namespace {

/// Whether results or operands that are too small for full precision become 0. The library of compilers sets this when
/// a program or a library that was linked with -ffast-math starts.
bool flushes_tiny_numbers() {
  volatile double smallest = std::numeric_limits<double>::min(), tiny = std::numeric_limits<double>::denorm_min();
  const volatile double half = smallest / 2, product = tiny * 4503599627370496.0;  // 2^52: the smallest normal number
  return half == 0 || product == 0;
}

std::string unusual_arithmetic() {
  if (fegetround() != FE_TONEAREST) return "the rounding of numbers was changed";
  if (flushes_tiny_numbers()) return "the treatment of tiny numbers (-ffast-math makes them 0) was changed";
  if (fegetexcept() != 0) return "the trapping of faults in calculations was changed";
  return "";
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
    if (changed.empty()) changed = "the locale of its thread was changed";
    uselocale(locale_);
  }
  sigset_t blocked{};
  pthread_sigmask(SIG_SETMASK, nullptr, &blocked);
  if (std::memcmp(&blocked, &blocked_, sizeof blocked) != 0) {
    if (changed.empty()) changed = "the set of signals that its thread blocks was changed";
    pthread_sigmask(SIG_SETMASK, &blocked_, nullptr);
  }
  return changed;
}

struct ProcessState::Parts {
  process_parts::WorkingFolder folder;
  process_parts::Locale locale;
  process_parts::SignalHandlers signals;
};

std::shared_ptr<ProcessState> ProcessState::of_runs() {
  static std::mutex mutex;
  static std::weak_ptr<ProcessState> known;
  const std::scoped_lock lock(mutex);
  std::shared_ptr<ProcessState> state = known.lock();
  if (!state) known = state = std::make_shared<ProcessState>();
  return state;
}

ProcessState::ProcessState() : parts_(std::make_unique<Parts>()) {}
ProcessState::~ProcessState() = default;

std::string ProcessState::put_back() {
  const std::scoped_lock lock(mutex_);
  std::string changed;
  for (const std::string& what : {parts_->folder.put_back(), parts_->locale.put_back(), parts_->signals.put_back()})
    if (changed.empty()) changed = what;
  if (!changed.empty()) ++changes_, last_change_ = changed;
  return changed;
}

void ProcessState::keep_during(const std::function<void()>& code) {
  const long before = changes_;
  const ThreadState thread;
  std::exception_ptr fault;
  try {
    code();
  } catch (...) {
    fault = std::current_exception();
  }
  std::string changed = thread.put_back();
  put_back();
  if (fault) std::rethrow_exception(fault);
  if (const std::scoped_lock lock(mutex_); changed.empty() && changes_ != before) changed = last_change_;
  if (!changed.empty()) throw Error(changed + " while it ran; a plugin must leave it as it is");
}

}  // namespace marrow
