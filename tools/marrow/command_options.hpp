// SPDX-License-Identifier: Apache-2.0
#pragma once
// Options that several commands share.
#include "commands.hpp"
#include "number_options.hpp"

namespace marrow::cli {

/// The pipeline's file, its inputs and --set.
void add_pipeline_arguments(CLI::App* command, PipelineRequest& request);
/// --file-memory and --file-seconds.
void add_file_limits(CLI::App* command, FileLimits& limits, const std::string& otherwise = "by its size");
/// --shared-cache: as the variable MARROW_SHARED_CACHE, also for the processes that the command starts.
void add_shared_cache(CLI::App* command);
/// --log-level.
void add_log_level(CLI::App* command, LogLevel& level);
/// Adds a note below the help: the command may load libraries to describe them.
void say_that_libraries_are_described(CLI::App* command);

}  // namespace marrow::cli
