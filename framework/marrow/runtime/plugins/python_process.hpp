// SPDX-License-Identifier: Apache-2.0
#pragma once
// Where Python is, and how a process is started that holds the nodes of a Python file.
#include <sys/types.h>

#include <filesystem>

#include "marrow/base/descriptor.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow {

/// The interpreter that runs nodes written in Python: MARROW_PYTHON, or /usr/bin/python3. Throws Error, with a text
/// that begins with a verb, if there is none.
std::filesystem::path python_interpreter();

/// Who owns the interpreter.
uid_t owner_of_interpreter();

/// The folder that holds marrow's Python package. Throws Error, with a text that begins with a verb, if there is none.
std::filesystem::path python_package_folder();

/// The settings that decide which modules a process of python_process() finds and how it runs them: the interpreter,
/// the search path, and the interpreter's own variables, such as PYTHONOPTIMIZE.
std::vector<std::string> python_settings();

/// A process that holds the nodes of `file` (python/marrow/node_process.py). Its descriptor 3 is the open file `made`,
/// through which it hands values over. From descriptor 4, `replies`, it reads the replies to its questions; `replies`
/// is -1 for a process that asks none. Hashes of texts have no random seed there, and numerical libraries use one
/// thread. Throws Error if others may write to a folder of the search path.
WorkerSettings python_process(const std::filesystem::path& file, int made, int replies = -1);

/// The way back to a process that asks something during a job: {"job": 7, "say": "ask", ...}. A reply is one line, a
/// JSON document.
class ReplyPipe {
 public:
  /// Throws Error if no more files can be opened.
  ReplyPipe();

  int read_end() const { return pipe_.read_end; }
  /// Call it when the process has been started: only the process reads.
  void close_read_end() { pipe_.read_end.close(); }
  /// Does nothing if the process has ended.
  void send(const nlohmann::json& reply);
  /// No more replies come.
  void close() { pipe_.write_end.close(); }

 private:
  Pipe pipe_;
};

}  // namespace marrow
