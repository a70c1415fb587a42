// SPDX-License-Identifier: Apache-2.0
#pragma once
// Options that several commands share, and options that take a number. Its text must be a decimal, finite number within
// its bounds, and nothing else. A number that is misread would change results silently.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "commands.hpp"

namespace marrow::cli {

/// Throws CLI::ValidationError unless the text is a whole number from `least` to `most`, without leading zeros.
std::uint64_t whole_number(const std::string& option, const std::string& text, std::uint64_t least, std::uint64_t most);
/// Throws CLI::ValidationError unless the text is a decimal number from `least` to `most`. `unit` and `end` are parts
/// of the message.
double number(const std::string& option, const std::string& text, double least, double most, const std::string& unit,
              const std::string& end = "");

template <class T>
CLI::Option* add_whole_number(CLI::App* command, const std::string& option, T& target, const std::string& help,
                              std::uint64_t least = 0, std::uint64_t most = std::numeric_limits<T>::max()) {
  const auto take = [=, &target](const std::string& text) { target = T(whole_number(option, text, least, most)); };
  return command->add_option_function<std::string>(option, take, help)->type_name("WHOLE NUMBER");
}

/// Bounds for megabytes and seconds: above 0, and small enough for clocks and counters.
inline constexpr double kLeastAmount = 0.001, kMostAmount = 1e9;

/// Adds an option for megabytes or seconds, within these bounds.
CLI::Option* add_amount(CLI::App* command, const std::string& option, double& target, const std::string& unit,
                        const std::string& help);

/// Sets the default that the help shows.
template <class T>
void show_default(CLI::Option* option, const T& value) {
  option->default_str(CLI::detail::to_string(value));
}

/// The pipeline's file, its inputs and --set.
void add_pipeline_arguments(CLI::App* command, PipelineRequest& request);
/// --file-memory and --file-seconds.
void add_file_limits(CLI::App* command, FileLimits& limits, const std::string& otherwise = "by its size");
/// --shared-cache: as the variable MARROW_SHARED_CACHE, also for the processes that the command starts.
void add_shared_cache(CLI::App* command);
/// --log-level, and -v for the lowest level.
void add_log_level(CLI::App* command, LogLevel& level);
/// Adds a note below the help: the command may load libraries to describe them.
void say_that_libraries_are_described(CLI::App* command);

// Tables on a terminal: the last column is wrapped at the terminal's edge.

/// Prints such a row for the terminal.
void print_beside(const std::string& head, const std::string& text, std::size_t indent);

/// How CLI11 writes the help, with rows that are wrapped.
std::shared_ptr<CLI::FormatterBase> wrapped_help();

}  // namespace marrow::cli
