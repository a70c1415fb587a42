// SPDX-License-Identifier: Apache-2.0
#pragma once
// One call of a program: its inputs as files, its output as a file.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "marrow/run/given_files.hpp"
#include "marrow/runtime/node/context.hpp"

namespace marrow::run {

struct ProgramOptions {
  std::vector<std::string> command, version_command;
  std::vector<std::filesystem::path> files;
  std::string output_file;
  double max_time_s = 3600;
  int max_memory_mb = 0;
};

/// Runs the command in a temporary folder of its own, and calls `read` with the file that it made. `formats`: those
/// that `read` understands. Throws Error if a place in the command is unknown, if the program fails or exceeds its
/// limits, or if it makes no such file; Cancelled if the run is stopped.
void with_output(const GivenInputs& inputs, const ProgramOptions& options, const std::vector<std::string>& formats,
                 Context& context, const std::function<void(const std::filesystem::path&)>& read);

}  // namespace marrow::run
