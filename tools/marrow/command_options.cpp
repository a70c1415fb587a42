// SPDX-License-Identifier: Apache-2.0
#include "command_options.hpp"

#include <cstdlib>

namespace marrow::cli {

void add_pipeline_arguments(CLI::App* command, PipelineRequest& request) {
  command->add_option("pipeline", request.file, "pipeline file (YAML)")->required();
  command->add_option("inputs", request.inputs, "values of the pipeline's inputs, as name=value");
  command
      ->add_option(
          "--set", request.overrides,
          "override, as node.option=value, node.uses=kind.name, node.may_fail=true or node.in.port=reference. A "
          "value is a text as it stands; one that begins with [, {, \" or ' is YAML")
      ->allow_extra_args(false)  // so that an input may stand after it
      ->type_name("NODE.OPTION=VALUE");
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
  command->add_option("--log-level", level, "the least of what is shown: debug, info, warning or error (default: info)")
      ->transform(CLI::CheckedTransformer(levels).description(""))
      ->type_name("LEVEL");
}

void say_that_libraries_are_described(CLI::App* command) {
  command->footer(
      "A plugin library that is not known yet is loaded once, in a process of its own, to be described; where nobody "
      "else may put one: see 'marrow doctor' and MARROW_PLUGIN_PATH.");
}

}  // namespace marrow::cli
