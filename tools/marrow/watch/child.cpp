// SPDX-License-Identifier: Apache-2.0
#include "child.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstring>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"

extern char** environ;

namespace marrow::cli {
namespace {

using Clock = std::chrono::steady_clock;
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
