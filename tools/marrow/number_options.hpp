// SPDX-License-Identifier: Apache-2.0
#pragma once
// Options that take a number. The text must be the number and nothing else: decimal, finite and within its bounds, for
// a number that is taken for another one changes results without a word.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <limits>
#include <string>

namespace marrow::cli {

/// Throws CLI::ValidationError for anything but digits without leading zeros, from `least` to `most`.
std::uint64_t whole_number(const std::string& option, const std::string& text, std::uint64_t least, std::uint64_t most);
/// Throws CLI::ValidationError for anything but a decimal number from `least` to `most`. `unit` and `end` are for the
/// sentence.
double number(const std::string& option, const std::string& text, double least, double most, const std::string& unit,
              const std::string& end = "");

template <class T>
CLI::Option* add_whole_number(CLI::App* command, const std::string& option, T& target, const std::string& help,
                              std::uint64_t least = 0, std::uint64_t most = std::numeric_limits<T>::max()) {
  const auto take = [=, &target](const std::string& text) { target = T(whole_number(option, text, least, most)); };
  return command->add_option_function<std::string>(option, take, help)->type_name("WHOLE NUMBER");
}

/// Of megabytes or seconds, within the bounds of amounts.
CLI::Option* add_amount(CLI::App* command, const std::string& option, double& target, const std::string& unit,
                        const std::string& help);

/// What the help shows as the default.
template <class T>
void show_default(CLI::Option* option, const T& value) {
  option->default_str(CLI::detail::to_string(value));
}

}  // namespace marrow::cli
