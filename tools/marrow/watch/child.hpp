// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <functional>
#include <string>
#include <vector>

namespace marrow::cli {

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
