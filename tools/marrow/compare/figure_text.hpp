// SPDX-License-Identifier: Apache-2.0
#pragma once
// Numbers of a comparison as texts. Only zero is written as 0.
#include <string>
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

}  // namespace marrow::cli
