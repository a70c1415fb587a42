// SPDX-License-Identifier: Apache-2.0
#include "compare/text_table.hpp"

#include <algorithm>

#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

/// The number of characters: all bytes but those that continue one.
std::size_t characters_in(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](unsigned char byte) { return (byte & 0xC0) != 0x80; }));
}

}  // namespace

void TextTable::add(const std::vector<std::string>& row) {
  rows_.emplace_back();
  for (const std::string& text : row) rows_.back().push_back(printable(text));
}

std::string TextTable::text() const {
  std::vector<std::size_t> widths(columns_.size());
  for (const auto& row : rows_)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], characters_in(row[c]));
  std::string text;
  for (const auto& row : rows_) {
    std::string line;
    for (std::size_t c = 0; c < row.size(); ++c) {
      const std::string blanks(widths[c] - characters_in(row[c]), ' ');
      line += (c ? "  " : "") + (columns_[c] == Side::right ? blanks + row[c] : row[c] + blanks);
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

}  // namespace marrow::cli
