// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/process_state.hpp"

#include <fcntl.h>
#include <locale.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <fstream>
#include <locale>
#include <map>
#include <opencv2/core.hpp>
#include <optional>
#include <vector>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/thread_state.hpp"

namespace marrow {

/// This namespace has a name because ProcessState::Parts, which the header declares, has members of these types.
namespace process_parts {

/// The folder at which all relative paths start. If a plugin's library changed it, inputs would be read and results
/// written in the wrong place.
class WorkingFolder {
 public:
  WorkingFolder() {
    if (descriptor_.is_open() && fstat(descriptor_, &status_) != 0) descriptor_.close();
  }
  /// Returns the folder in which the process was; empty if it had not changed.
  std::string go_back() const {
    struct stat now {};
    if (!descriptor_.is_open() ||
        (stat(".", &now) == 0 && now.st_dev == status_.st_dev && now.st_ino == status_.st_ino))
      return "";
    std::error_code error;
    const std::filesystem::path elsewhere = std::filesystem::current_path(error);
    if (fchdir(descriptor_) != 0) return "";
    return error ? "a folder that is gone" : elsewhere.string();
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
    return "the locale";
  }

 private:
  const std::locale of_streams_;
  const std::string of_c_ = setlocale(LC_ALL, nullptr);
};

class Environment {
 public:
  std::string put_back() const {
    if (is_same()) return "";
    std::map<std::string, std::string> before, now = variables(texts_of_process());
    for (const auto& [name, value] : variables(texts_)) {
      if (const auto found = now.find(name); found == now.end() || found->second != value)
        setenv(name.c_str(), value.c_str(), 1);
      now.erase(name);
    }
    for (const auto& [name, value] : now) unsetenv(name.c_str());
    return "the environment";
  }

 private:
  static std::vector<std::string> texts_of_process() {
    std::vector<std::string> texts;
    for (char** one = environ; one && *one; ++one) texts.emplace_back(*one);
    return texts;
  }
  static std::map<std::string, std::string> variables(const std::vector<std::string>& texts) {
    std::map<std::string, std::string> found;
    for (const std::string& text : texts)
      if (const std::size_t end = text.find('='); end != std::string::npos)
        found.try_emplace(text.substr(0, end), text.substr(end + 1));
    return found;
  }
  bool is_same() const {
    std::size_t i = 0;
    for (char** one = environ; one && *one; ++one, ++i)
      if (i >= texts_.size() || texts_[i] != *one) return false;
    return i == texts_.size();
  }

  const std::vector<std::string> texts_ = texts_of_process();
};

class SignalHandlers {
 public:
  SignalHandlers() {
    for (int signal = 1; signal < kEnd; ++signal) sigaction(signal, nullptr, &actions_[std::size_t(signal)]);
  }
  std::string put_back() const {
    std::string changed;
    for (int signal = 1; signal < kEnd; ++signal) {
      const struct sigaction& before = actions_[std::size_t(signal)];
      struct sigaction now {};
      if (sigaction(signal, nullptr, &now) != 0 || now.sa_sigaction == before.sa_sigaction) continue;
      sigaction(signal, &before, nullptr);
      changed = "the handling of a signal";
    }
    return changed;
  }

 private:
  static constexpr int kEnd = 32;  // the signals from here on belong to libraries
  std::array<struct sigaction, kEnd> actions_{};
};

/// Which files the three standard streams are.
class StandardStreams {
 public:
  StandardStreams() {
    for (int i = 0; i < 3; ++i) {
      if (fstat(i, &files_[std::size_t(i)]) != 0) continue;
      copies_[std::size_t(i)] = Descriptor(fcntl(i, F_DUPFD_CLOEXEC, 3));
    }
  }
  std::string put_back() const {
    std::string changed;
    for (int i = 0; i < 3; ++i) {
      const struct stat& before = files_[std::size_t(i)];
      struct stat now {};
      const int copy = copies_[std::size_t(i)];
      if (copy < 0 || (fstat(i, &now) == 0 && now.st_dev == before.st_dev && now.st_ino == before.st_ino)) continue;
      dup2(copy, i);
      changed = "a standard stream";
    }
    return changed;
  }

 private:
  std::array<struct stat, 3> files_{};
  std::array<Descriptor, 3> copies_;
};

class Limits {
 public:
  Limits() {
    for (std::size_t i = 0; i < kWhich.size(); ++i) getrlimit(kWhich[i], &before_[i]);
  }
  std::string put_back() const {
    std::string changed;
    for (std::size_t i = 0; i < kWhich.size(); ++i) {
      rlimit now{};
      if (getrlimit(kWhich[i], &now) != 0 ||
          (now.rlim_cur == before_[i].rlim_cur && now.rlim_max == before_[i].rlim_max))
        continue;
      if (setrlimit(kWhich[i], &before_[i]) != 0) {  // only root can raise the upper limit again
        now.rlim_cur = std::min(before_[i].rlim_cur, now.rlim_max);
        setrlimit(kWhich[i], &now);
      }
      changed = "a limit of the process";
    }
    return changed;
  }

 private:
  static constexpr std::array kWhich{RLIMIT_NOFILE, RLIMIT_AS,    RLIMIT_DATA, RLIMIT_FSIZE,
                                     RLIMIT_CPU,    RLIMIT_STACK, RLIMIT_NPROC};
  std::array<rlimit, kWhich.size()> before_{};
};

/// Which permissions new files do not get. Only /proc tells it without changing it.
class PermissionsMask {
 public:
  PermissionsMask() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("Umask:")) before_ = mode_t(std::strtoul(line.c_str() + 6, nullptr, 8));
  }
  std::string put_back() const {
    return before_ && umask(*before_) != *before_ ? "the mask of new files' permissions (umask)" : "";
  }

 private:
  std::optional<mode_t> before_;
};

}  // namespace process_parts

using namespace process_parts;

namespace {

/// How plugin code ended.
struct Ended {
  std::exception_ptr fault;
  std::string changed;

  void expect_sound() const {
    if (fault) std::rethrow_exception(fault);
    if (!changed.empty()) throw Error(changed + " while it ran; a plugin must leave it as it is");
  }
};

Ended call(const std::function<void()>& code, ProcessState& state) {
  Ended ended;
  const ThreadState thread;
  try {
    code();
  } catch (...) {
    ended.fault = std::current_exception();
  }
  const std::string of_thread = thread.put_back(), of_process = state.put_back();
  ended.changed = of_thread.empty() ? of_process : of_thread + " was changed";
  return ended;
}

}  // namespace

struct ProcessState::Parts {
  WorkingFolder folder;
  Locale locale;
  Environment environment;
  SignalHandlers signals;
  StandardStreams streams;
  Limits limits;
  PermissionsMask mask;
  std::atomic<bool> has_opencv{false};

  std::string put_back_opencv() const {
    if (!has_opencv || (cv::useOptimized() && cv::getNumThreads() == 1)) return "";
    cv::setUseOptimized(true);
    cv::setNumThreads(1);
    return "a setting of OpenCV";
  }
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

void ProcessState::set_up_opencv() {
  const std::scoped_lock lock(mutex_);
  cv::setNumThreads(1);
  cv::setUseOptimized(true);
  parts_->has_opencv = true;
}

std::string ProcessState::put_back() {
  const std::scoped_lock lock(mutex_);
  const std::string elsewhere = parts_->folder.go_back();
  std::string changed = elsewhere.empty() ? "" : "the working folder was changed to " + elsewhere;
  for (const std::string& what :
       {parts_->locale.put_back(), parts_->environment.put_back(), parts_->signals.put_back(),
        parts_->streams.put_back(), parts_->limits.put_back(), parts_->mask.put_back(), parts_->put_back_opencv()})
    if (changed.empty() && !what.empty()) changed = what + " was changed";
  if (!changed.empty()) ++changes_;
  return changed;
}

void ProcessState::keep_during(const std::function<void()>& code) {
  {
    const std::shared_lock beside_others(calls_);
    const long before = changes_;
    const Ended ended = call(code, *this);
    if (ended.changed.empty() && changes_ == before) return ended.expect_sound();
  }
  const std::unique_lock alone(calls_);
  call(code, *this).expect_sound();
}

void ProcessState::keep_for_process(const std::function<void()>& start) {
  constexpr int kMostTimes = 10;  // code that keeps changing the state fails in keep_during()
  for (int time = 0; time < kMostTimes; ++time) {
    const long before = changes_;
    start();
    if (put_back().empty() && changes_ == before) return;
  }
}

}  // namespace marrow
