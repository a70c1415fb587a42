// SPDX-License-Identifier: Apache-2.0
#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/auxv.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <sstream>
#include <string>

#include "marrow/base/descriptor.hpp"
#include "marrow/runtime/plugins/linked_libraries.hpp"

namespace marrow {
namespace {

namespace fs = std::filesystem;

/// The program that loads libraries; it is a part of each process.
std::string loader_of_system() {
  Dl_info info{};
  const auto begin = reinterpret_cast<const void*>(getauxval(AT_BASE));
  return begin && dladdr(begin, &info) && info.dli_fname ? info.dli_fname : "";
}

/// What a program prints; empty if it cannot be started.
std::string output_of(const std::vector<std::string>& command) {
  Pipe pipe = open_pipe();
  if (!pipe.read_end.is_open()) return "";
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipe.write_end, STDOUT_FILENO);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  std::vector<char*> arguments;
  for (const std::string& text : command) arguments.push_back(const_cast<char*>(text.c_str()));
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int fault = posix_spawn(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  pipe.write_end.close();
  std::string output;
  std::array<char, 4096> buffer;
  for (ssize_t count = 0;
       !fault && (count = read(pipe.read_end, buffer.data(), buffer.size())) != 0 && (count > 0 || errno == EINTR);)
    if (count > 0) output.append(buffer.data(), std::size_t(count));
  while (!fault && waitpid(process, nullptr, 0) < 0 && errno == EINTR) continue;
  return output;
}

}  // namespace

std::vector<fs::path> libraries_to_load(const fs::path& library) {
  std::vector<fs::path> found;
  const std::string loader = loader_of_system();
  if (loader.empty()) return found;
  std::istringstream lines(output_of({loader, "--list", fs::absolute(library).string()}));
  for (std::string line; std::getline(lines, line);) {  // "\tNAME => PATH (0xADDRESS)", or only "\tPATH (0xADDRESS)"
    const std::size_t arrow = line.find(" => "), begin = arrow == std::string::npos ? 1 : arrow + 4,
                      end = line.rfind(" (0x");
    if (end != std::string::npos && begin < end && line[begin] == '/') found.push_back(line.substr(begin, end - begin));
  }
  return found;
}

}  // namespace marrow
