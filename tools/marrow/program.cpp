// SPDX-License-Identifier: Apache-2.0
// Reads the command line, and says which of its words are not known.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <new>

#include "commands.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

/// The program itself is not named as it was called: that is a path.
std::string name_of(const CLI::App& command) { return command.get_parent() ? command.get_name() : "marrow"; }

/// What to do instead of giving `word` ("--case=x") to a command.
std::string advice_for_option(const CLI::App& command, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  std::vector<std::string> known;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& one : option->get_lnames()) known.push_back("--" + one);
  const auto longer = std::find_if(known.begin(), known.end(), [&](const auto& one) { return one.starts_with(name); });
  const std::string nearest = longer != known.end() ? *longer : nearest_name(name, known);
  const std::string meant = nearest.empty() ? "" : "did you mean " + in_quotes(nearest) + "?";
  if (command.get_option_no_throw("inputs") != nullptr) {
    const std::string bare = word.substr(std::min(word.find_first_not_of('-'), word.size()));
    return (meant.empty() ? "an" : meant + " An") +
           std::string(" input of the pipeline is given without dashes, as  ") + bare + (name == word ? "=VALUE" : "");
  }
  if (!meant.empty()) return meant;
  if (command.get_parent() == nullptr) return "options of a command stand after its name";
  return "known: those that --help shows";
}

/// Throws Error if a word of the command line is empty, or an option has an empty value ("--out="): the program would
/// treat it as not given.
void expect_no_empty_word(const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    const bool is_option = word.starts_with("--") && word.size() > 2 && word.find('=') == word.size() - 1;
    if (!word.empty() && !is_option) continue;
    const std::string before = is_option ? word.substr(0, word.size() - 1) : i ? words[i - 1] : "";
    throw Error("a word " + (before.empty() ? "of the command" : "after " + in_quotes(before)) +
                " is empty, and nothing has an empty name; a variable may have no value");
  }
}

/// A message about the first word that should be a command and is not, with the nearest command. Empty if there is no
/// such word.
std::string unknown_command(const CLI::App& app, const std::vector<std::string>& arguments) {
  const CLI::App* at = &app;
  for (const std::string& word : arguments) {
    if (word.starts_with('-')) continue;  // no command that has commands has options with values
    std::vector<std::string> known;
    const CLI::App* found = nullptr;
    for (const CLI::App* one : at->get_subcommands(nullptr)) {
      if (one->get_name() == word) found = one;
      if (!one->get_group().empty()) known.push_back(one->get_name());
    }
    if (found == nullptr && known.empty()) return "";
    if (found == nullptr)
      return (at == &app ? "there is no" : in_quotes(name_of(*at)) + " has no") + std::string(" command ") +
             in_quotes(word) + "; " + suggestion(word, known);
    at = found;
  }
  return "";
}

/// A message about the first option that its command does not have, with the nearest one. `app` must have read the
/// command line. Empty if there is no such option.
std::string unknown_option(const CLI::App& app) {
  for (const CLI::App* at = &app;; at = at->get_subcommands()[0]) {
    for (const std::string& word : at->remaining())
      if (word.starts_with('-') && word != "--")
        return in_quotes(name_of(*at)) + " has no option " + in_quotes(word.substr(0, word.find('='))) + "; " +
               advice_for_option(*at, word);
    if (at->get_subcommands().empty()) return "";
  }
}

using Commands = std::initializer_list<void (*)(CLI::App& app, int& code)>;

int run_command(int argc, char** argv, Commands commands) {
  CLI::App app{"marrow finds the 3D pose of bone fragments in X-ray images, by pipelines of plugins described in YAML.",
               "marrow"};
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("marrow ") + MARROW_VERSION, "print the version and end");
  app.footer(
      "Plugins are looked for in the folders of MARROW_PLUGIN_PATH and beside the program's library; see 'marrow "
      "doctor'.");
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return CLI::FailureMessage::simple(failed,
                                       CLI::Error(error.get_name(), printable(error.what()), error.get_exit_code()));
  });
  int code = 0;
  for (const auto add : commands) add(app, code);
  expect_no_empty_word({argv + std::min(argc, 1), argv + argc});
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const std::string command = unknown_command(app, {argv + std::min(argc, 1), argv + argc});
    if (!command.empty()) throw Error(command);
    if (error.get_exit_code() == 0) return app.exit(error);  // --help or --version
    if (const std::string option = unknown_option(app); !option.empty()) throw Error(option);
    app.exit(error);
    return 2;
  }
  return code;
}

}  // namespace

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
