// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/plugins/python_process.hpp"
#include "marrow/base/framework_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <string_view>
#include <utility>

#include "marrow/base/error.hpp"
#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/plugins/trust.hpp"

namespace marrow {

namespace fs = std::filesystem;

namespace {

/// The variables of each process, besides the search path. "PYTHONSAFEPATH" keeps the working folder out of it.
constexpr const char* kVariables[] = {
    "PYTHONHASHSEED=0",       "PYTHONSAFEPATH=1",  "PYTHONDONTWRITEBYTECODE=1", "OMP_NUM_THREADS=1",
    "OPENBLAS_NUM_THREADS=1", "MKL_NUM_THREADS=1", "OPENCV_FOR_THREADS_NUM=1",  "MARROW_WITHOUT_PYTHON_NODES=1"};

/// Whether python_process() itself sets the variable of NAME=VALUE.
bool is_set_here(const std::string& text) {
  const std::string name = text.substr(0, text.find('=') + 1);
  return name == "PYTHONPATH=" || std::any_of(std::begin(kVariables), std::end(kVariables),
                                              [&](const char* one) { return std::string_view(one).starts_with(name); });
}

/// The folder of marrow's package, then PYTHONPATH. Relative folders are those of the working folder.
std::string search_path() {
  std::string path = python_package_folder().string();
  const char* given = std::getenv("PYTHONPATH");
  if (!given || !*given) return path;
  std::istringstream folders(std::string(given) + ":");
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code error;
    const fs::path full = fs::absolute(folder.empty() ? "." : folder, error);
    path += ":" + (error ? folder : full.lexically_normal().string());
  }
  return path;
}

}  // namespace

fs::path python_interpreter() {
  const char* given = std::getenv("MARROW_PYTHON");
  const fs::path interpreter = given && *given ? given : "/usr/bin/python3";
  if (!interpreter.is_absolute())
    throw Error("cannot be described: MARROW_PYTHON is '" + interpreter.string() +
                "', expected the full path of an interpreter");
  if (access(interpreter.c_str(), X_OK) != 0)
    throw Error("cannot be described: there is no Python interpreter " + interpreter.string() +
                "; install python3, or name another one in MARROW_PYTHON");
  return interpreter;
}

fs::path python_package_folder() {
  const fs::path library = framework_file();
  for (fs::path above = library.parent_path(); above != above.root_path(); above = above.parent_path())
    for (const char* place : {"python", "python3/dist-packages"})
      if (fs::exists(above / place / "marrow" / "plugin.py")) return above / place;
  throw Error("cannot be described: marrow's Python package is not there; install python3-marrow");
}

std::vector<std::string> python_settings() {
  std::error_code error;
  std::vector<std::string> settings{python_interpreter().string(), fs::canonical(python_interpreter(), error).string(),
                                    "PYTHONPATH=" + search_path()};
  for (char** one = environ; one && *one; ++one)
    if (const std::string text = *one; text.starts_with("PYTHON") && !is_set_here(text)) settings.push_back(text);
  std::sort(settings.begin() + 2, settings.end());
  return settings;
}

uid_t owner_of_interpreter() {
  struct stat status {};
  return stat(python_interpreter().c_str(), &status) == 0 ? status.st_uid : 0;
}

WorkerSettings python_process(const fs::path& file, int made, int replies) {
  // Python runs a sitecustomize.py in these folders before anything can be checked.
  std::vector<fs::path> folders;
  std::istringstream path(search_path());
  for (std::string folder; std::getline(path, folder, ':');) folders.emplace_back(folder);
  if (const std::string fault = untrusted_among(folders, owner_of_interpreter()); !fault.empty()) throw Error(fault);
  std::vector<int> shared{made};
  if (replies >= 0) shared.push_back(replies);
  std::vector<std::string> command{"/usr/bin/env", "PYTHONPATH=" + search_path()};
  command.insert(command.end(), std::begin(kVariables), std::end(kVariables));
  command.push_back(python_interpreter().string());
  command.push_back((python_package_folder() / "marrow" / "node_process.py").string());
  command.push_back(file.string());
  return {command, shared};
}

ReplyPipe::ReplyPipe() : pipe_(open_pipe()) {
  if (!pipe_.read_end.is_open()) throw Error(std::string("cannot start a process: ") + std::strerror(errno));
}

void ReplyPipe::send(const nlohmann::json& reply) { write_all(pipe_.write_end, reply.dump() + "\n"); }

}  // namespace marrow
