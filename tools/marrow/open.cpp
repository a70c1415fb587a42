// SPDX-License-Identifier: Apache-2.0
// `marrow open`: starts the workbench, a separate program and package.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cstring>

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "process.hpp"

namespace marrow::cli {

void add_open(CLI::App& app, int&) {
  CLI::App* command = app.add_subcommand(
      "open", "open a folder in the browser: make cases, place bones, edit pipelines, look at results");
  command->set_help_flag();  // the workbench answers --help, too
  command->prefix_command();
  command->callback([command] {
    const std::filesystem::path program = this_program().parent_path() / "marrow-workbench";
    std::vector<std::string> words{"marrow", "open"};
    for (const std::string& word : command->remaining()) words.push_back(word);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    execv(program.c_str(), arguments.data());
    if (errno == ENOENT) throw Error("the workbench is not installed: install the package marrow-workbench");
    throw Error("cannot start " + program.string() + ": " + std::strerror(errno));
  });
}

}  // namespace marrow::cli
