// SPDX-License-Identifier: Apache-2.0
#include "mistyped.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

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

}  // namespace

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

std::string unknown_option(const CLI::App& app) {
  for (const CLI::App* at = &app;; at = at->get_subcommands()[0]) {
    for (const std::string& word : at->remaining())
      if (word.starts_with('-') && word != "--") return text_on_option(*at, word);
    if (at->get_subcommands().empty()) return "";
  }
}

}  // namespace marrow::cli
