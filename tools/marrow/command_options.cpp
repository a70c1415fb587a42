// SPDX-License-Identifier: Apache-2.0
#include "command_options.hpp"

#include <charconv>
#include <cstdlib>

#include "marrow/base/number_text.hpp"

namespace marrow::cli {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& expected) {
  throw CLI::ValidationError(option + " is '" + text + "', but must be " + expected);
}

/// Whether the whole text is a number that the type can hold.
template <class T>
bool is_read(const std::string& text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::uint64_t whole_number(const std::string& option, const std::string& text, std::uint64_t least,
                           std::uint64_t most) {
  std::uint64_t value = 0;
  const bool has_leading_zero = text.size() > 1 && text[0] == '0';
  if (!is_read(text, value) || has_leading_zero || value < least || value > most)
    refuse(option, text,
           formatted("a whole number from {} to {}{}", least, most,
                     has_leading_zero ? ", in decimal digits without leading zeros" : ""));
  return value;
}

double number(const std::string& option, const std::string& text, double least, double most, const std::string& unit,
              const std::string& end) {
  double value = 0;
  if (!is_read(text, value) || !(value >= least && value <= most))
    refuse(option, text, "a number of " + unit + " from " + exact_number(least) + " to " + exact_number(most) + end);
  return value;
}

CLI::Option* add_amount(CLI::App* command, const std::string& option, double& target, const std::string& unit,
                        const std::string& help) {
  const auto take = [=, &target](const std::string& text) {
    target = number(option, text, kLeastAmount, kMostAmount, unit);
  };
  return command->add_option_function<std::string>(option, take, help)->type_name("NUMBER");
}

void add_pipeline_arguments(CLI::App* command, PipelineRequest& request) {
  command->add_option("pipeline", request.file, "pipeline file (YAML)")->required();
  command->add_option("inputs", request.inputs, "values of the pipeline's inputs, as name=value");
  command
      ->add_option(
          "--set", request.overrides,
          "override, as node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference. A "
          "value is taken as a text; if it begins with [, {, \" or ', it is YAML")
      ->allow_extra_args(false)  // so that an input may follow it
      ->type_name("NODE.OPTION=VALUE");
  command
      ->add_option("--set-file", request.settings,
                   "YAML file with values that differ from machine to machine: {inputs: {name: value}, set: "
                   "{node.option: value}}. Arguments and --set count more")
      ->allow_extra_args(false)
      ->type_name("FILE");
}

void add_file_limits(CLI::App* command, FileLimits& limits, const std::string& otherwise) {
  const std::string end = " that reading a file may use (default: " + otherwise + ")";
  add_amount(command, "--file-memory", limits.memory_mb, "megabytes", "megabytes" + end);
  add_amount(command, "--file-seconds", limits.seconds, "seconds", "seconds of processor time" + end);
}

void add_shared_cache(CLI::App* command) {
  command
      ->add_option_function<std::string>(
          "--shared-cache", [](const std::string& folder) { setenv("MARROW_SHARED_CACHE", folder.c_str(), 1); },
          "folder in which hosts share results (default: MARROW_SHARED_CACHE)")
      ->type_name("FOLDER");
}

void add_log_level(CLI::App* command, LogLevel& level) {
  const std::map<std::string, LogLevel> levels{
      {"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}, {"error", LogLevel::error}};
  CLI::Option* named =
      command
          ->add_option("--log-level", level,
                       "show messages of this level and above: debug, info, warning or error (default: info)")
          ->transform(CLI::CheckedTransformer(levels).description(""))
          ->type_name("LEVEL");
  command
      ->add_flag_callback(
          "-v,--verbose", [&level] { level = LogLevel::debug; }, "as --log-level debug")
      ->excludes(named);
}

void say_that_libraries_are_described(CLI::App* command) {
  command->footer(
      "A plugin library that marrow does not know yet is loaded once in a separate process, which describes it. Only "
      "folders that nobody else may write to are searched: see 'marrow doctor' and MARROW_PLUGIN_PATH.");
}

}  // namespace marrow::cli
