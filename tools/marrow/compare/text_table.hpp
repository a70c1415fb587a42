// SPDX-License-Identifier: Apache-2.0
#pragma once
// Texts in columns, for the terminal.
#include <string>
#include <vector>

namespace marrow::cli {

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

}  // namespace marrow::cli
