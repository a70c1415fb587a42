// SPDX-License-Identifier: Apache-2.0
#pragma once
// The tables of a comparison for the terminal: their numbers as texts, and texts in columns. Only zero is written as 0.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/compare/statistics.hpp"

namespace marrow::cli {

/// One notation for the numbers of a column. It has as many decimals as these numbers need: four between 1 and 100, and
/// more for smaller ones. Numbers beyond 10^7, and those so small that the decimals leave fewer than two
/// digits of them, are written with an exponent.
class NumberScale {
 public:
  /// Numbers that are not finite do not count.
  explicit NumberScale(const std::vector<double>& values);
  std::string text(double value) const;

 private:
  bool has_exponents_ = false;  ///< all numbers have one
  int decimals_ = 4;
};

/// "2/60 (0.9 to 11.4 %)", or "-" of nothing.
std::string rate_text(std::size_t count, std::size_t of, const compare::Interval& interval, int decimals);

enum class Side { left, right };

/// Rows of texts under each other, two blanks apart. A column is as wide as its widest text, so no text runs into the
/// next one, however long it is. Widths count characters (code points of UTF-8), not bytes.
class TextTable {
 public:
  /// To which side the texts of each column go.
  explicit TextTable(std::vector<Side> columns) : columns_(std::move(columns)) {}

  /// Adds a row. Texts that are left out at its end are empty. Control characters are written as escapes.
  void add(const std::vector<std::string>& row);
  /// All rows, each as a line without blanks at its end.
  std::string text() const;

 private:
  std::vector<Side> columns_;
  std::vector<std::vector<std::string>> rows_;
};

/// A field of a CSV file (RFC 4180), quoted if necessary. A text that a spreadsheet would take for a formula, such as a
/// reason that begins with "=", is marked as text. Control characters are written out, because a terminal would execute
/// them. Line breaks stay.
std::string csv_field(const std::string& raw);
/// With nine digits; empty for nothing.
std::string csv_number(const std::optional<double>& value);

/// The cells of a line; a quoted one may hold commas and, doubled, quotes.
std::vector<std::string> csv_cells(const std::string& line);

}  // namespace marrow::cli
