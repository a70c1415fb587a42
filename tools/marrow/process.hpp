// SPDX-License-Identifier: Apache-2.0
#pragma once
// The process: its streams, its signals, its last error messages, and programs that it runs.
#include <atomic>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace marrow::cli {

/// Call this first in main(). Opens standard streams that the caller closed on /dev/null, so that no other file gets
/// their numbers. If a reader goes away or a file exceeds the size limit, the write fails, and the process continues.
void prepare_process();

/// The exit code for main(): `code`, but 1 instead of 0 if the printed text could not be written. It is not a fault if
/// the reader has gone away.
int with_output_written(int code);

/// From now on, SIGINT, SIGTERM and SIGHUP set the returned flag: the program should stop. A second signal ends the
/// process at once.
const std::atomic<bool>& stop_on_signals();

/// Sets the line that the first of these signals prints to stderr. At most 500 bytes are shown. Empty, the default: no
/// line. Do not call this from several threads at once.
void say_when_stopped(const std::string& line);

/// The file of this program, to be started again or to find what is installed beside it.
std::filesystem::path this_program();

/// The reason for the stop, for example "stopped by Ctrl-C".
std::string stopped_text();

struct ChildEnd {
  int code = 0;          ///< exit code; 128 + N after signal N
  bool stopped = false;  ///< because `should_stop` returned true
  std::string said;      ///< the last 200,000 characters that it printed, on both streams
};

enum class Said { passed_on, kept };  ///< what it prints also goes to the standard error, or not

/// Runs a program to its end. Calls `should_stop` several times a second; once it returns true, the program gets
/// SIGINT, and SIGKILL after another 10 s. Throws Error if it cannot be started.
ChildEnd run_child(const std::vector<std::string>& command, const std::function<bool()>& should_stop,
                   Said said = Said::passed_on);

}  // namespace marrow::cli
