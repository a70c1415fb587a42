// SPDX-License-Identifier: Apache-2.0
#pragma once
// Runs a program of somebody else and waits for its end. No shell is involved.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// A program, what it is given, and what it may use.
struct ProgramCall {
  std::vector<std::string> command;  ///< the program and its arguments
  std::filesystem::path folder;      ///< its working folder
  double seconds = 0;                ///< by the clock; 0: no limit
  double memory_mb = 0;              ///< of it and all that it starts; 0: no limit
  /// Called at least ten times a second. If it throws, the program is killed and the exception passed on.
  std::function<void()> check;
};

/// How a program ended. It and all that it started are gone.
struct ProgramEnd {
  int exit_code = 0;
  int signal = 0;  ///< that ended it, or 0
  bool is_late = false, is_out_of_memory = false;
  std::string printed;  ///< the last 64 kB of what it printed on its standard output and its standard error
};

/// The file of a program: the path itself, or where the folders of PATH have that name. Throws Error if there is none.
std::filesystem::path program_file(const std::string& program);

/// Runs a program with an empty standard input, in a process group of its own. Throws Error if it cannot be started.
ProgramEnd run_program(const ProgramCall& call);

/// "; it printed:" and the last lines, or "; it printed nothing": the end of a message about the program.
std::string printed_by_program(const ProgramEnd& end);

/// Why the program did not do its work, with the last lines that it printed; empty if it ended with 0. `call` and `end`
/// belong together.
std::string failure_of_program(const ProgramCall& call, const ProgramEnd& end);

}  // namespace marrow
