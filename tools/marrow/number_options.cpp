// SPDX-License-Identifier: Apache-2.0
#include "number_options.hpp"

#include <charconv>

#include "amount_bounds.hpp"
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

}  // namespace marrow::cli
