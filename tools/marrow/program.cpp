// SPDX-License-Identifier: Apache-2.0
// Reads the command line and runs the command that it names.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <new>
#include <string>
#include <vector>

#include "command_options.hpp"
#include "marrow/base/printable.hpp"
#include "process.hpp"

namespace marrow::cli {
namespace {

using Commands = std::initializer_list<void (*)(CLI::App& app, int& code)>;

/// The program itself is not named as it was called: that is a path.
std::string name_of_command(const CLI::App& command) { return command.get_parent() ? command.get_name() : "marrow"; }

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

std::string text_on_option(const CLI::App& command, const std::string& word) {
  return in_quotes(name_of_command(command)) + " has no option " + in_quotes(word.substr(0, word.find('='))) + "; " +
         advice_for_option(command, word);
}

/// The command that a word names, or nullptr.
const CLI::App* command_named(const CLI::App& app, const std::string& word) {
  for (const CLI::App* one : app.get_subcommands(nullptr))
    if (one->get_name() == word) return one;
  return nullptr;
}

/// How many words follow an option as its values.
std::size_t values_of(const CLI::Option* option) {
  return option ? std::size_t(std::max(0, option->get_items_expected_min())) : 0;
}

const CLI::Option* option_of_letter(const CLI::App& command, char letter) {
  return command.get_option_no_throw(std::string("-") + letter);
}

/// Whether a word such as -qo consists of options of one letter, of which only the last takes a value.
bool are_letters(const CLI::App& command, const std::string& word) {
  const auto is_flag = [&](char letter) {
    const CLI::Option* option = option_of_letter(command, letter);
    return option != nullptr && values_of(option) == 0;
  };
  return std::all_of(word.begin() + 1, word.end() - 1, is_flag) && option_of_letter(command, word.back()) != nullptr;
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

/// Throws Error if one dash is followed by anything but options of a single letter, of which the last may want a value
/// (-nq, -qo FOLDER). "-out=x" would count as the folder "ut=x".
void expect_letters_after_one_dash(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* command = &app;
  for (std::size_t i = 0; i < words.size() && words[i] != "--" && !command->get_prefix_command(); ++i) {
    const std::string& word = words[i];
    if (!word.starts_with('-')) {
      const CLI::App* found = command_named(*command, word);
      if (found == nullptr && !command->get_subcommands(nullptr).empty()) return;  // no command: that is said first
      if (found != nullptr) command = found;
      continue;
    }
    const CLI::Option* option = command->get_option_no_throw(word);
    if (option == nullptr && !word.starts_with("--") && word.size() > 2) {
      if (!are_letters(*command, word)) throw Error(text_on_option(*command, word));
      option = option_of_letter(*command, word.back());
    }
    i += values_of(option);
  }
}

/// A message about the first word that should be a command and is not, with the nearest command. Empty if there is no
/// such word.
std::string unknown_command(const CLI::App& app, const std::vector<std::string>& words) {
  const CLI::App* at = &app;
  for (const std::string& word : words) {
    if (word.starts_with('-')) continue;  // no command that has commands has options with values
    std::vector<std::string> known;
    for (const CLI::App* one : at->get_subcommands(nullptr))
      if (!one->get_group().empty()) known.push_back(one->get_name());
    const CLI::App* found = command_named(*at, word);
    if (found == nullptr && known.empty()) return "";
    if (found == nullptr)
      return (at == &app ? "there is no" : in_quotes(name_of_command(*at)) + " has no") + std::string(" command ") +
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
      if (word.starts_with('-') && word != "--") return text_on_option(*at, word);
    if (at->get_subcommands().empty()) return "";
  }
}

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

/// Starts the workbench, a separate program and package.
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
