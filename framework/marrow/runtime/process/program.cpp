// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/process/program.hpp"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>

#include "marrow/base/descriptor.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/process_tree.hpp"
#include "marrow/base/stopwatch.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostKept = 64'000;
constexpr int kLook_ms = 50;

std::vector<char*> words_of(const std::vector<std::string>& texts) {
  std::vector<char*> words;
  for (const std::string& text : texts) words.push_back(const_cast<char*>(text.c_str()));
  words.push_back(nullptr);
  return words;
}

std::vector<fs::path> folders_of_path() {
  const char* path = std::getenv("PATH");
  std::vector<fs::path> folders;
  std::istringstream stream(path ? path : "/usr/local/bin:/usr/bin:/bin");
  for (std::string folder; std::getline(stream, folder, ':');)
    if (folder.starts_with('/')) folders.emplace_back(folder);  // the working folder is another one
  return folders;
}

bool can_run(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0;
}

/// A child process and all that it starts. They are gone when this is.
class Child {
 public:
  Child(const ProgramCall& call, const fs::path& program, int output) {
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output, STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions, call.folder.c_str());
    const SpawnAttributes attributes;
    const int fault =
        posix_spawn(&process_, program.c_str(), &actions, attributes.get(), words_of(call.command).data(), environ);
    if (fault) process_ = -1;
    posix_spawn_file_actions_destroy(&actions);
    if (fault == EAGAIN || fault == ENOMEM)
      throw NoProcess(std::string("cannot start a process: ") + std::strerror(fault));
    if (fault) throw Error("the program " + program.string() + " cannot be started: " + std::strerror(fault));
  }
  ~Child() { end(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  bool has_ended() const {
    siginfo_t gone{};
    return waitid(P_PID, id_t(process_), &gone, WEXITED | WNOHANG | WNOWAIT) == 0 && gone.si_pid != 0;
  }
  double memory_mb(double enough_mb) const { return memory_of_tree_mb(process_, enough_mb); }
  /// Kills it and all that it started. Returns its status.
  int end() {
    if (process_ < 0) return 0;
    kill_tree(process_);
    int status = 0;
    while (waitpid(process_, &status, 0) < 0 && errno == EINTR) continue;
    process_ = -1;
    return status;
  }

 private:
  pid_t process_ = -1;
};

/// Takes what has been printed, without waiting. Keeps the end of it.
void take_printed(int descriptor, std::string& printed) {
  char buffer[65536];
  for (ssize_t count = 0; (count = read(descriptor, buffer, sizeof buffer)) > 0;) {
    printed.append(buffer, std::size_t(count));
    if (printed.size() > 2 * kMostKept) printed.erase(0, printed.size() - kMostKept);
  }
}

std::string last_lines(const std::string& printed) {
  constexpr std::size_t kMostLines = 20;
  std::size_t begin = printed.find_last_not_of("\n ");
  if (begin == printed.npos) return "";
  const std::size_t end = begin + 1;
  for (std::size_t lines = 0; lines < kMostLines && begin != printed.npos; ++lines)
    begin = begin == 0 ? printed.npos : printed.rfind('\n', begin - 1);
  return printed.substr(begin == printed.npos ? 0 : begin + 1, begin == printed.npos ? end : end - begin - 1);
}

}  // namespace

fs::path program_file(const std::string& program) {
  if (program.empty()) throw Error("the program has no name");
  if (program.starts_with('/')) {
    std::error_code error;
    if (can_run(program)) return program;
    if (fs::is_regular_file(program, error))
      throw Error(program +
                  " is no program: it may not be executed; make it so with chmod +x, or name what runs it, "
                  "such as python3, before it");
    throw Error("there is no program " + program + "; install it, or name another");
  }
  if (program.find('/') != program.npos)
    throw Error("the program " + in_quotes(program) +
                " is neither a whole path nor a name on the PATH; a program runs in a folder of its own, so a path "
                "that starts in this one leads nowhere");
  std::vector<std::string> known;
  for (const fs::path& folder : folders_of_path()) {
    if (can_run(folder / program)) return folder / program;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
      known.push_back(entry.path().filename().string());
  }
  const std::string nearest = nearest_name(program, known);
  throw Error("there is no program " + in_quotes(program) + " on the PATH; " +
              (nearest.empty() ? "" : "did you mean " + in_quotes(nearest) + "? Or ") +
              "install it, or write its whole path");
}

ProgramEnd run_program(const ProgramCall& call) {
  const fs::path program = program_file(call.command.at(0));
  Pipe pipe = open_pipe();
  if (!pipe.read_end.is_open()) throw NoProcess(std::string("cannot start a process: ") + std::strerror(errno));
  const auto start = Clock::now();
  Child child(call, program, pipe.write_end);
  pipe.write_end.close();
  fcntl(pipe.read_end, F_SETFL, O_NONBLOCK);
  ProgramEnd end;
  while (!child.has_ended()) {
    if (call.check) call.check();
    pollfd polled{pipe.read_end, POLLIN, 0};
    poll(&polled, 1, kLook_ms);
    // A program that has closed its output goes on without it.
    if (polled.revents & (POLLHUP | POLLERR) && !(polled.revents & POLLIN)) usleep(kLook_ms * 1000);
    take_printed(pipe.read_end, end.printed);
    end.is_late = call.seconds > 0 && seconds_since(start) > call.seconds;
    end.is_out_of_memory = call.memory_mb > 0 && child.memory_mb(call.memory_mb) > call.memory_mb;
    if (end.is_late || end.is_out_of_memory) break;
  }
  const int status = child.end();
  take_printed(pipe.read_end, end.printed);
  if (end.printed.size() > kMostKept) end.printed.erase(0, end.printed.size() - kMostKept);
  if (WIFSIGNALED(status)) end.signal = WTERMSIG(status);
  if (WIFEXITED(status)) end.exit_code = WEXITSTATUS(status);
  return end;
}

std::string printed_by_program(const ProgramEnd& end) {
  const std::string lines = last_lines(end.printed);
  return lines.empty() ? "; it printed nothing" : "; it printed:\n" + lines;
}

std::string failure_of_program(const ProgramCall& call, const ProgramEnd& end) {
  std::string why;
  if (end.is_late)
    why = formatted("took longer than {:g} s", call.seconds);
  else if (end.is_out_of_memory)
    why = formatted("used more than {:g} MB of memory", call.memory_mb);
  else if (end.signal)
    why = std::string("crashed: ") + strsignal(end.signal);
  else if (end.exit_code)
    why = formatted("ended with exit code {}", end.exit_code);
  if (why.empty()) return "";
  return "the program " + in_quotes(call.command.at(0)) + " " + why + printed_by_program(end);
}

}  // namespace marrow
