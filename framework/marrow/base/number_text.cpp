// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/number_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace marrow {

std::string detail::formatted(fmt::string_view format, fmt::format_args values) { return fmt::vformat(format, values); }

std::string short_number(double value, int digits) { return fmt::format("{:.{}g}", value, digits); }

std::string fixed_number(double value, int decimals) {
  const std::string text = fmt::format("{:.{}f}", value, decimals);
  const bool is_zero = text.find_first_of("123456789in") == std::string::npos;
  return text[0] == '-' && is_zero ? text.substr(1) : text;
}

std::string exact_number(double value) {
  const bool is_whole = value == std::trunc(value) && std::abs(value) < 1e15;
  return is_whole ? fmt::format("{:.0f}", value) : shortest_number(value);
}

std::string shortest_number(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

std::string percent_text(double share, int decimals) {
  constexpr int kMostDecimals = 14;  // what a double near 1 has
  const bool is_between = share > 0 && share < 1;
  for (; decimals <= kMostDecimals; ++decimals) {
    const std::string text = fixed_number(100 * share, decimals);
    const double shown = parsed_number(text).value_or(0);
    if (!is_between || (shown > 0 && shown < 100)) return text;
  }
  return fmt::format("{:.1e}", 100 * share);
}

std::string counted(std::size_t count, std::string_view what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

std::string counted(std::size_t count, std::string_view one, std::string_view more) {
  return fmt::format("{} {}", count, count == 1 ? one : more);
}

std::optional<double> parsed_number(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace marrow
