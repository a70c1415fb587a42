// SPDX-License-Identifier: Apache-2.0
#pragma once
// Python files that declare nodes, as if they were plugin libraries; where Python is, and how a process is started that
// holds the nodes of a file.
#include <sys/types.h>
#include <filesystem>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>

#include "marrow/plugin.hpp"
#include "marrow/runtime/plugins/library.hpp"
#include "marrow/runtime/process/worker.hpp"

namespace marrow {

/// Whether the file's name ends in .py and it holds a decorator of nodes, such as @marrow.node. False in a process of a
/// Python node, which would otherwise start another one, and so on.
bool is_python_plugin(const std::filesystem::path& file);

/// Describes a file by a Python process with limits of time and memory. `linked` has the interpreter, the modules and
/// libraries that the process loaded from outside of the standard library, and the libraries of its kinds. `digest` is
/// made from the file, from all of these, and from python_settings(). The description may be a refusal. Throws Error,
/// with a text that begins with a verb, if there is no Python or the file is not trusted.
LibraryInfo describe_python_file(const std::filesystem::path& file);

/// The same from the user's cache of descriptions, unless one of these files has changed, with the build id.
LibraryInfo python_file_info(const std::filesystem::path& file, const Digest& framework);

/// The nodes of a file. Their calls start Python processes. Throws Error if the file is not as `described`.
std::unique_ptr<Plugin> load_python_file(const LibraryInfo& described);

/// Digest of a Python file and of all files that it loads. Throws Error if one of the files is gone.
Digest digest_of_python(const LibraryInfo& described);

/// Adds to `more_loaded`, and to the kept description, what a process has loaded in addition. From then on
/// is_fully_described() is false for `described`, because its build id does not cover what was added.
void add_to_description(const LibraryInfo& described, const nlohmann::json& answer, std::set<std::string>& more_loaded);
bool is_fully_described(const LibraryInfo& described);

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
