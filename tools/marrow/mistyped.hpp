// SPDX-License-Identifier: Apache-2.0
#pragma once
// What is said about words of the command line that are not known: what is wrong, and the nearest known word.
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace marrow::cli {

/// Throws Error if a word of the command line is empty, or an option has an empty value ("--out="): the program would
/// treat it as not given.
void expect_no_empty_word(const std::vector<std::string>& words);

/// Throws Error if one dash is followed by anything but options of a single letter, of which the last may want a value
/// (-nq, -qo FOLDER). "-out=x" would count as the folder "ut=x".
void expect_letters_after_one_dash(const CLI::App& app, const std::vector<std::string>& words);

/// A message about the first word that should be a command and is not, with the nearest command. Empty if there is no
/// such word.
std::string unknown_command(const CLI::App& app, const std::vector<std::string>& words);

/// A message about the first option that its command does not have, with the nearest one. `app` must have read the
/// command line. Empty if there is no such option.
std::string unknown_option(const CLI::App& app);

}  // namespace marrow::cli
