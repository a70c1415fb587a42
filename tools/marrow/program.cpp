// SPDX-License-Identifier: Apache-2.0
// Reads the command line and runs the command that it names.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <new>

#include "columns.hpp"
#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "mistyped.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

using Commands = std::initializer_list<void (*)(CLI::App& app, int& code)>;

int run_command(int argc, char** argv, Commands commands) {
  CLI::App app{"marrow finds the 3D pose of bone fragments in X-ray images, by pipelines of plugins described in YAML.",
               "marrow"};
  app.formatter(wrapped_help());
  app.require_subcommand(1);
  app.set_version_flag("-V,--version", version_text(), "print the version and end");
  app.footer(
      "Plugins are looked for in the folders of MARROW_PLUGIN_PATH and beside the program's library; see 'marrow "
      "doctor'.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return CLI::FailureMessage::simple(failed,
                                       CLI::Error(error.get_name(), printable(error.what()), error.get_exit_code()));
  });
  int code = 0;
  for (const auto add : commands) add(app, code);
  const std::vector<std::string> words{argv + std::min(argc, 1), argv + argc};
  expect_no_empty_word(words);
  try {
    expect_letters_after_one_dash(app, words);
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string command = unknown_command(app, words);
    if (!command.empty()) throw Error(command);
    if (error.get_exit_code() == 0) return app.exit(error);  // --help or --version
    if (const std::string option = unknown_option(app); !option.empty()) throw Error(option);
    app.exit(error);
    return 2;
  }
  return code;
}

}  // namespace

std::string version_text() { return "marrow " MARROW_VERSION; }

void add_version(CLI::App& app, int&) {
  app.add_subcommand("version", "print the version")->callback([] { std::printf("%s\n", version_text().c_str()); });
}

int run_program(int argc, char** argv, Commands commands) {
  prepare_process();
  try {
    return with_output_written(run_command(argc, argv, commands));
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "marrow: error: out of memory\n");
    return 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: error: %s\n", printable_lines(error.what()).c_str());
    return 2;
  }
}

}  // namespace marrow::cli
