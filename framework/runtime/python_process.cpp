// SPDX-License-Identifier: Apache-2.0
#include "python_process.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "marrow/domain/error.hpp"
#include "marrow/runtime/library.hpp"

namespace marrow {

namespace fs = std::filesystem;

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

WorkerSettings python_process(const fs::path& file, int made, int replies) {
  const char* before = std::getenv("PYTHONPATH");
  std::string path = python_package_folder().string();
  if (before && *before) path += std::string(":") + before;
  std::vector<int> shared{made};
  if (replies >= 0) shared.push_back(replies);
  return {{"/usr/bin/env", "PYTHONPATH=" + path, "PYTHONHASHSEED=0", "PYTHONSAFEPATH=1", "PYTHONDONTWRITEBYTECODE=1",
           "OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1", "MKL_NUM_THREADS=1", "OPENCV_FOR_THREADS_NUM=1",
           "MARROW_WITHOUT_PYTHON_NODES=1", python_interpreter().string(), "-m", "marrow.plugin", file.string()},
          shared};
}

ReplyPipe::ReplyPipe() {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw Error(std::string("cannot start a process: ") + std::strerror(errno));
  read_end_ = ends[0];
  write_end_ = ends[1];
}

ReplyPipe::~ReplyPipe() {
  close_read_end();
  close(write_end_);
}

void ReplyPipe::close_read_end() {
  if (read_end_ >= 0) close(std::exchange(read_end_, -1));
}

void ReplyPipe::send(const nlohmann::json& reply) {
  const std::string line = reply.dump() + "\n";
  for (std::size_t done = 0; done < line.size();) {
    const ssize_t count = write(write_end_, line.data() + done, line.size() - done);
    if (count < 0 && errno != EINTR) return;
    if (count > 0) done += std::size_t(count);
  }
}

}  // namespace marrow
