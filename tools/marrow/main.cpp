// SPDX-License-Identifier: Apache-2.0
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <new>

#include "commands.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "process.hpp"
#include "unknown_words.hpp"

namespace {

int run_program(int argc, char** argv) {
  using namespace marrow::cli;
  CLI::App app{
      "marrow finds the 3D pose of bone fragments in X-ray images, by pipelines of plugins described in YAML."};
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("marrow ") + MARROW_VERSION, "print the version and end");
  app.footer(
      "Plugins are looked for in the folders of MARROW_PLUGIN_PATH and beside the program's library; see 'marrow "
      "doctor'.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return CLI::FailureMessage::simple(
        failed, CLI::Error(error.get_name(), marrow::printable(error.what()), error.get_exit_code()));
  });
  int code = 0;
  for (const auto add :
       {add_run,    add_compare,     add_cell,         add_chunk,    add_worker,  add_rerun, add_diff,  add_show,
        add_check,  add_plan,        add_cache,        add_list,     add_inspect, add_new,   add_graph, add_schema,
        add_doctor, add_conformance, add_check_worker, add_describe, add_watch,   add_open})
    add(app, code);
  expect_no_empty_word({argv + std::min(argc, 1), argv + argc});
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string command = unknown_command(app, {argv + std::min(argc, 1), argv + argc});
    if (!command.empty()) throw marrow::Error(command);
    if (error.get_exit_code() == 0) return app.exit(error);  // --help or --version
    if (const std::string option = unknown_option(app); !option.empty()) throw marrow::Error(option);
    app.exit(error);
    return 2;
  }
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  marrow::cli::prepare_process();
  try {
    return marrow::cli::with_output_written(run_program(argc, argv));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "marrow: error: out of memory\n");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: error: %s\n", marrow::printable_lines(error.what()).c_str());
    return 2;
  }
}
