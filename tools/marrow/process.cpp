// SPDX-License-Identifier: Apache-2.0
#include "process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <spawn.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <new>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"

namespace marrow::cli {
namespace {

using Clock = std::chrono::steady_clock;

std::atomic<bool> is_stopped{false};

std::atomic<int> stopped_by{0};

std::atomic<const char*> stop_text{""};

/// Writes to the standard error without allocating memory, because there may be none left.
void say(const char* text) {
  if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) return;  // nobody can read it
}

/// For an exception that nobody caught, for example in a thread or before main(). Prints a sentence instead of
/// aborting.
[[noreturn]] void on_terminate() {
  say("marrow: error: ");
  try {
    if (const std::exception_ptr error = std::current_exception()) std::rethrow_exception(error);
    say("it ended for an unknown reason");
  } catch (const std::bad_alloc&) {
    say("out of memory");
  } catch (const std::exception& error) {
    say(error.what());
  } catch (...) {
    say("an exception of an unknown type");
  }
  say("\n");
  _exit(1);
}

extern "C" void on_stop(int signal) {
  if (is_stopped.exchange(true)) {  // the second signal: do not wait for the nodes
    say("\nmarrow: stopped at once; what was being done is lost\n");
    _exit(130);
  }
  stopped_by = signal;
  const char* text = stop_text.load();
  if (!*text) return;
  say("\n");
  say(text);
  say("\n");
}

bool nobody_reads(int stream) {
  pollfd event{stream, POLLOUT, 0};
  return poll(&event, 1, 0) > 0 && (event.revents & POLLERR);
}

constexpr std::size_t kMostKept = 200'000;

constexpr auto kUntilKilled = std::chrono::seconds(10);

/// Starts the program in its own process group, so that Ctrl-C reaches only this process.
pid_t started(const std::vector<std::string>& command, int output) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t all;
  sigfillset(&all);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETPGROUP);
  std::vector<char*> arguments;
  for (const std::string& text : command) arguments.push_back(const_cast<char*>(text.c_str()));
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int fault = posix_spawnp(&process, arguments[0], &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  if (fault) throw Error("cannot start " + command[0] + ": " + std::strerror(fault));
  return process;
}

/// Reads the next part of the output. False at the end.
bool take(int from, Said said, std::string& kept) {
  char text[4096];
  const ssize_t count = read(from, text, sizeof text);
  if (count <= 0) return count < 0 && errno == EINTR;
  if (said == Said::passed_on) std::fwrite(text, 1, std::size_t(count), stderr);
  kept.append(text, std::size_t(count));
  if (kept.size() > 2 * kMostKept) kept.erase(0, kept.size() - kMostKept);
  return true;
}

}  // namespace

void prepare_process() {
  std::set_terminate(on_terminate);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO})
    if (fcntl(stream, F_GETFD) < 0 && open("/dev/null", O_RDWR) < 0) break;  // open() takes the lowest free number
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // The caller may ignore the end of children. Then the system would forget how workers ended, and could give their
  // numbers to other processes at once.
  std::signal(SIGCHLD, SIG_DFL);
}

int with_output_written(int code) {
  if ((std::fflush(stdout) == 0 && !std::ferror(stdout)) || nobody_reads(STDOUT_FILENO)) return code;
  std::fprintf(stderr, "marrow: error: what was to be printed could not be written; is the disk full?\n");
  return code ? code : 1;
}

const std::atomic<bool>& stop_on_signals() {
  std::signal(SIGINT, on_stop);
  std::signal(SIGTERM, on_stop);
  if (std::signal(SIGHUP, on_stop) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);  // started by nohup
  return is_stopped;
}

void say_when_stopped(const std::string& line) {
  // A handler may read one text meanwhile, so the other is written.
  static std::array<std::array<char, 501>, 2> texts;
  static std::size_t next = 0;
  std::array<char, 501>& text = texts[next];
  next = 1 - next;
  text[line.copy(text.data(), text.size() - 1)] = 0;
  stop_text = text.data();
}

std::filesystem::path this_program() { return std::filesystem::read_symlink("/proc/self/exe"); }

std::string stopped_text() {
  if (stopped_by == SIGHUP) return "stopped, because its terminal was closed";
  if (stopped_by == SIGTERM) return "stopped, because it was asked to end (SIGTERM)";
  return "stopped by Ctrl-C";
}

ChildEnd run_child(const std::vector<std::string>& command, const std::function<bool()>& should_stop, Said said) {
  Pipe pipe = open_pipe();
  if (!pipe.read_end.is_open()) throw Error("cannot start " + command[0] + ": " + std::strerror(errno));
  const pid_t process = started(command, pipe.write_end);
  pipe.write_end.close();
  ChildEnd end;
  Clock::time_point stopped_at;
  for (pollfd readable{pipe.read_end, POLLIN, 0};;) {
    if (poll(&readable, 1, 200) > 0 && !take(pipe.read_end, said, end.said)) break;
    if (!end.stopped && should_stop()) {
      end.stopped = true;
      stopped_at = Clock::now();
      kill(-process, SIGINT);
    } else if (end.stopped && Clock::now() - stopped_at > kUntilKilled) {
      kill(-process, SIGKILL);
    }
  }
  pipe.read_end.close();
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return end;
}

}  // namespace marrow::cli

extern char** environ;
