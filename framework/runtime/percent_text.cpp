// SPDX-License-Identifier: Apache-2.0
#include "runtime/percent_text.hpp"

#include "marrow/domain/number_text.hpp"

namespace marrow {
namespace {

constexpr int kMostDecimals = 14;  // what a double near 1 has

}  // namespace

std::string percent_text(double share, int decimals) {
  const bool is_between = share > 0 && share < 1;
  for (; decimals <= kMostDecimals; ++decimals) {
    const std::string text = formatted("%.*f", decimals, 100 * share);
    const double shown = parsed_number(text).value_or(0);
    if (!is_between || (shown > 0 && shown < 100)) return text;
  }
  return formatted("%.1e", 100 * share);
}

}  // namespace marrow
