// SPDX-License-Identifier: Apache-2.0
#include "compare/text_table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::cli {
namespace {

constexpr double kLargestFixed = 1e7, kSmallestFixed = 1e-5;

int power_of_ten(double value) { return int(std::floor(std::log10(value))); }

/// The number of characters: all bytes but those that continue one.
std::size_t characters_in(const std::string& text) {
  return std::size_t(std::count_if(text.begin(), text.end(), [](unsigned char byte) { return (byte & 0xC0) != 0x80; }));
}

}  // namespace

NumberScale::NumberScale(const std::vector<double>& values) {
  double largest = 0, smallest = std::numeric_limits<double>::infinity();
  for (const double value : values) {
    const double size = std::abs(value);
    if (!std::isfinite(size) || size == 0) continue;
    largest = std::max(largest, size);
    smallest = std::min(smallest, size);
  }
  if (largest == 0) return;
  has_exponents_ = largest >= kLargestFixed || largest < kSmallestFixed;
  if (has_exponents_) return;
  const int of_largest = power_of_ten(largest), of_smallest = power_of_ten(smallest);
  const int wanted = of_largest < 0 ? 3 - of_largest : of_largest < 2 ? 4 : std::max(0, 5 - of_largest);
  decimals_ = std::clamp(2 - of_smallest, wanted, wanted + 3);  // three digits of the smallest, if that is not too many
}

std::string NumberScale::text(double value) const {
  if (value == 0) return fixed_number(0, has_exponents_ ? 0 : decimals_);
  const bool is_too_small = std::abs(value) < 10 * std::pow(10.0, -decimals_);
  return has_exponents_ || is_too_small ? formatted("{:.3e}", value) : formatted("{:.{}f}", value, decimals_);
}

std::string rate_text(std::size_t count, std::size_t of, const compare::Interval& interval, int decimals) {
  if (!of) return "-";
  return formatted("{}/{} ({} to {} %)", count, of, percent_text(interval.lower, decimals),
                   percent_text(interval.upper, decimals));
}

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
