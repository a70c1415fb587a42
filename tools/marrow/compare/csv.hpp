// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace marrow::cli {

/// A field of a CSV file (RFC 4180), quoted if necessary. A text that a spreadsheet would take for a formula, such as a
/// reason that begins with "=", is marked as text. Control characters are written out, because a terminal would execute
/// them. Line breaks stay.
std::string csv_field(const std::string& raw);
/// With nine digits; empty for nothing.
std::string csv_number(const std::optional<double>& value);

/// The cells of a line; a quoted one may hold commas and, doubled, quotes.
std::vector<std::string> csv_cells(const std::string& line);

}  // namespace marrow::cli
