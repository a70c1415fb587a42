// SPDX-License-Identifier: Apache-2.0
#pragma once
// Texts of numbers that are the same in every locale. std::snprintf, std::to_string and std::strtod use the decimal
// sign of the locale that the process has set, as a script with `locale.setlocale` does: "0,5" in Germany. Such a text
// is another number, or several cells, to whoever reads it.
#include <optional>
#include <string>
#include <string_view>

namespace marrow {

/// What std::snprintf gives in the "C" locale.
[[gnu::format(printf, 1, 2)]] std::string formatted(const char* format, ...);

/// The number that all of the text stands for, such as 1, -0.5, +2e-3, inf or nan. Nothing if the text is empty, has a
/// blank or any other character besides, or if the number is too large.
std::optional<double> parsed_number(std::string_view text);

}  // namespace marrow
