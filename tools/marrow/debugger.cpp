// SPDX-License-Identifier: Apache-2.0
#include "debugger.hpp"

#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <vector>

#include "marrow/base/error.hpp"
#include "process.hpp"
#include "report/report.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> command_of(const std::string& debugger, const fs::path& folder) {
  const std::string name = fs::path(debugger).filename().string();
  std::vector<std::string> command{debugger};
  bool can_stop = true;
  if (name == "gdb")
    command.insert(command.end(), {"-q", "-ex", "set breakpoint pending on", "-ex", "run", "--args"});
  else if (name == "lldb")
    command.insert(command.end(), {"-o", "run", "--"});
  else
    can_stop = false;  // SIGTRAP would end what no debugger holds
  command.insert(command.end(), {this_program().string(), "replay", folder.string(), "--in-this-process"});
  if (can_stop) command.push_back("--stop");
  return command;
}

}  // namespace

std::string debugger_line(const std::string& debugger, const fs::path& folder) {
  return "marrow replay " + shell_path(folder) + " --debugger " + shell_word(debugger);
}

void start_under_debugger(const std::string& debugger, const fs::path& folder) {
  std::vector<std::string> command = command_of(debugger, folder);
  std::vector<char*> words;
  for (std::string& word : command) words.push_back(word.data());
  words.push_back(nullptr);
  std::fflush(stdout);
  for (const int ignored : {SIGPIPE, SIGXFSZ}) std::signal(ignored, SIG_DFL);
  ::execvp(words[0], words.data());
  throw Error("the debugger '" + debugger + "' cannot be started: " + std::strerror(errno) +
              "; install it, or name another with --debugger");
}

}  // namespace marrow::cli
