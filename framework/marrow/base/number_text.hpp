// SPDX-License-Identifier: Apache-2.0
#pragma once
// The one place that converts numbers to texts and texts to numbers. The results are the same in every locale.
// std::snprintf, std::to_string and std::strtod use the decimal sign of the process's locale, which a script may have
// set with `locale.setlocale`: "0,5" in Germany. A reader would take this for another number, or for several cells.
#include <fmt/core.h>

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

namespace detail {
std::string formatted(fmt::string_view format, fmt::format_args values);
}

/// A text with values in the places of the {}: {:.2f}, {:>8}. The syntax is that of the library fmt, and the compiler
/// checks it.
template <class... Values>
std::string formatted(fmt::format_string<Values...> format, Values&&... values) {
  return detail::formatted(format, fmt::make_format_args(values...));
}

/// With at most so many significant digits and without trailing zeros: 0.125, 1.5e-07, 95.
std::string short_number(double value, int digits = 3);

/// With so many decimals. Zero has no minus sign, even if it results from rounding.
std::string fixed_number(double value, int decimals);

/// The shortest text from which the same number is read again. Whole numbers below 1e15 have all their digits, so that
/// they can also be read as integers.
std::string exact_number(double value);

/// The shortest text from which the same number is read again: 1e+05 for 100000. Files of poses hold such texts.
std::string shortest_number(double value);

/// A share, from 0 to 1, in percent, with at least so many decimals. A share that is neither 0 nor 1 gets as many more
/// as it needs not to read as 0 or 100: with one decimal, 1 of 3000 is 0.03.
std::string percent_text(double share, int decimals);

/// "1 case", "2 cases". The plural of `what` is formed with an s.
std::string counted(std::size_t count, std::string_view what);

/// "1 pass", "2 passes", or "1 node was", "2 nodes were".
std::string counted(std::size_t count, std::string_view one, std::string_view more);

/// The number that all of the text stands for, such as 1, -0.5, +2e-3, inf or nan. Nothing if the text is empty, has a
/// blank or any other character besides, or if the number is too large or too close to zero for a double.
std::optional<double> parsed_number(std::string_view text);

}  // namespace marrow
