// SPDX-License-Identifier: Apache-2.0
// The parent's side of a worker, which gives the work.
#include "marrow/runtime/process/worker.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

#include "marrow/base/error.hpp"
#include "marrow/base/framework_file.hpp"
#include "marrow/base/json_text.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/stopwatch.hpp"

namespace marrow {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestLine = std::size_t(64) << 20;
/// The time between two checks counts as this at most. If it was longer, this process was suspended.
constexpr double kLongestLook_s = 1;
constexpr int kFirstFreeDescriptor = 64;  // above the descriptors that the worker is given
constexpr rlim_t kMostFiles = kFirstFreeDescriptor + 16, kEnoughFiles = 1024;

[[noreturn]] void cannot_start(int code) {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  if (code == EMFILE || (code == EINVAL && files.rlim_cur <= kMostFiles))
    throw NoProcess(
        formatted("cannot start a process: no more than {} files may be open at once; raise the limit (ulimit -n {})",
                  files.rlim_cur, kEnoughFiles));
  throw NoProcess(std::string("cannot start a process: ") + std::strerror(code) +
                  (code == EAGAIN ? "; the limit of processes is reached (ulimit -u)" : ""));
}

/// The same file under a number that is different from all descriptors of the worker.
Descriptor above_those_of_worker(int original) {
  Descriptor copy(fcntl(original, F_DUPFD_CLOEXEC, kFirstFreeDescriptor));
  if (!copy.is_open()) cannot_start(errno);
  return copy;
}

Pipe make_pipe() {
  const Pipe pipe = open_pipe();
  if (!pipe.read_end.is_open()) cannot_start(errno);
  return {above_those_of_worker(pipe.read_end), above_those_of_worker(pipe.write_end)};
}

/// The environment, with the number of this process added. A worker that has another parent knows that it was left
/// behind.
std::vector<std::string> environment_of_worker() {
  std::vector<std::string> texts;
  for (char** one = environ; one && *one; ++one)
    if (std::strncmp(*one, "MARROW_PARENT=", 14) != 0) texts.emplace_back(*one);
  texts.push_back(formatted("MARROW_PARENT={}", getpid()));
  return texts;
}

std::vector<char*> pointers_to(const std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (const std::string& text : texts) pointers.push_back(const_cast<char*>(text.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

pid_t start(const WorkerSettings& settings, int input, int output) {
  std::vector<Descriptor> shared;
  for (const int original : settings.shared) shared.push_back(above_those_of_worker(original));
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  if (settings.quiet) posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  for (std::size_t i = 0; i < shared.size(); ++i) posix_spawn_file_actions_adddup2(&actions, shared[i], 3 + int(i));
  const SpawnAttributes attributes;
  const std::vector<std::string> environment = environment_of_worker();
  pid_t process = -1;
  const int fault = posix_spawn(&process, settings.command.at(0).c_str(), &actions, attributes.get(),
                                pointers_to(settings.command).data(), pointers_to(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (fault) {
    if (fault == ENOENT || fault == EACCES)
      throw Error("cannot start " + settings.command[0] + ": " + std::strerror(fault) + "; install marrow again");
    cannot_start(fault);
  }
  return process;
}

/// Waits until the process has ended and returns its status. A signal handler of the program interrupts a wait.
int status_of_ended(pid_t process) {
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR) continue;
  return status;
}

}  // namespace

Worker::Worker(const WorkerSettings& settings) {
  auto input = make_pipe(), output = make_pipe();
  process_ = start(settings, input.read_end, output.write_end);
  to_ = std::move(input.write_end);
  from_ = std::move(output.read_end);
  fcntl(from_, F_SETFL, O_NONBLOCK);
}

Worker::~Worker() { close(); }

void Worker::close() {
  if (process_ <= 0) return;
  kill_tree(process_);
  status_of_ended(process_);
  process_ = -1;
  is_busy_ = false;
}

void Worker::ask(json request) {
  request["job"] = ++job_;
  is_busy_ = true;
  is_waiting_ = false;
  at_.clear();
  seconds_ = 0;
  looked_ = Clock::now();
  const std::string line = request.dump() + "\n";
  if (to_.is_open() && !write_all(to_, line)) to_.close();  // it has ended; the next take() reports it
}

std::optional<WorkerEnd> Worker::take(const Said& said) {
  if (is_dead()) return std::nullopt;
  char buffer[65536];
  ssize_t count = 0;
  while ((count = read(from_, buffer, sizeof buffer)) > 0) {
    text_.append(buffer, std::size_t(count));
    if (text_.size() > kLongestLine) return ended("sent a line without end");
    for (std::size_t newline; (newline = text_.find('\n')) != std::string::npos;) {
      const std::string line = text_.substr(0, newline);
      text_.erase(0, newline + 1);
      if (auto end = understand(line, said)) return end;
    }
  }
  if (count < 0 && (errno == EAGAIN || errno == EINTR)) return std::nullopt;
  return died();
}

std::optional<WorkerEnd> Worker::understand(const std::string& line, const Said& said) {
  json message;
  try {
    message = parse_json(line, "a worker's line");
  } catch (const Error&) {
  }
  if (!message.is_object() || !is_busy_ || message.value("job", json()) != json(job_))
    return ended("sent something that is not part of its job");
  if (message.contains("say")) {
    const json what = message["say"];
    if (what == "at" && message.value("place", json()).is_string()) at_ = message["place"];
    seconds();
    if (what == "waiting" || what == "goes on") is_waiting_ = what == "waiting";
    if (said) said(message);
    return std::nullopt;
  }
  WorkerEnd end;
  if (message.contains("end")) {
    end.answer = message["end"];
  } else {
    const json reason = message.value("failed", json());
    end.failed = reason.is_string() && !reason.get_ref<const std::string&>().empty() ? reason.get<std::string>()
                                                                                     : "gave no reason";
    end.is_out_of_memory = message.value("out_of_memory", json()) == json(true);
  }
  is_busy_ = false;
  return end;
}

WorkerEnd Worker::died() {
  siginfo_t gone{};
  // Its output has ended. If the process itself has not ended after a second, it is of no use and is killed.
  for (int i = 0; i < 100 && waitid(P_PID, id_t(process_), &gone, WEXITED | WNOHANG | WNOWAIT) == 0 && gone.si_pid == 0;
       ++i)
    usleep(10'000);
  kill_tree(process_);
  const int status = status_of_ended(process_);
  process_ = -1;
  is_busy_ = false;
  WorkerEnd end;
  end.died = true;
  const std::string where = at_.empty() ? "" : " in " + at_;
  if (WIFSIGNALED(status)) {
    end.signal = WTERMSIG(status);
    end.failed = "crashed" + where + ": " + strsignal(end.signal);
    if (end.signal == SIGKILL) end.failed += ", as by a system whose memory, or that of a cluster's job, runs out";
  } else {
    end.failed = formatted("ended{} with exit code {}", where, WEXITSTATUS(status));
  }
  return end;
}

WorkerEnd Worker::ended(const std::string& why) {
  close();
  WorkerEnd end;
  end.died = true;
  end.failed = "its process" + (at_.empty() ? "" : " in " + at_) + " " + why;
  return end;
}

std::optional<WorkerEnd> Worker::check(const WorkerLimits& limits) {
  if (is_dead() || !is_busy_) return std::nullopt;
  std::string late;
  if (seconds() > limits.seconds)
    late = formatted("took longer than {:g} s", limits.seconds);
  else if (limits.seconds < WorkerLimits().seconds && suspended_seconds_ > limits.suspended_seconds)
    late = formatted("was suspended for more than {:g} s", limits.suspended_seconds);
  if (!late.empty()) {
    WorkerEnd end = ended(late);
    end.is_late = true;
    return end;
  }
  const bool has_limit = limits.memory_mb < WorkerLimits().memory_mb;
  if (has_limit && memory_of_tree_mb(process_, limits.memory_mb) > limits.memory_mb) {
    WorkerEnd end = ended(formatted("used more than {:g} MB of memory", limits.memory_mb));
    end.is_out_of_memory = true;
    return end;
  }
  return std::nullopt;
}

WorkerEnd Worker::wait(const WorkerLimits& limits, const std::atomic<bool>* cancelled, const Said& said) {
  for (;;) {
    if (cancelled && cancelled->load()) {
      ended("was stopped");
      throw Cancelled();
    }
    pollfd polled{from_, POLLIN, 0};
    poll(&polled, 1, 20);
    if (auto end = take(said)) return *end;
    if (auto end = check(limits)) return *end;
  }
}

/// The state of its main thread, as in `ps`; 0 if there is no such process.
char Worker::state() const {
  std::ifstream stream(formatted("/proc/{}/stat", process_));
  std::string text;
  std::getline(stream, text);
  const std::size_t name_end = text.rfind(") ");
  return name_end != std::string::npos && name_end + 2 < text.size() ? text[name_end + 2] : 0;
}

bool Worker::is_suspended() const { return state() == 'T'; }

bool Worker::is_ending() const { return state() == 'Z'; }

double Worker::seconds() {
  const auto now = Clock::now();
  const double passed = std::chrono::duration<double>(now - looked_).count();
  looked_ = now;
  const double counted = std::min(passed, kLongestLook_s);
  const bool suspended = is_suspended();
  suspended_seconds_ = suspended ? suspended_seconds_ + counted : 0;
  if (is_busy_ && !is_waiting_ && !suspended) seconds_ += counted;
  return seconds_;
}

double Worker::memory_mb() const { return memory_of_tree_mb(process_, 0); }

std::string killed_from_outside(const std::string& process) {
  return process +
         " was killed from outside (SIGKILL), as by a system whose memory, or that of a cluster's job, runs out; run "
         "it again, with more memory or fewer threads";
}

std::filesystem::path worker_program() { return framework_file().parent_path() / "marrow" / "marrow-worker"; }

}  // namespace marrow
