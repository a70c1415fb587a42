// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <vector>

#include "marrow/base/export.hpp"

// Tests that are repeated while cases are added. With twenty looks at p < 0.05, a quarter of the experiments without a
// difference would show one. Here all looks together show one in at most alpha of them.
namespace MARROW_EXPORT marrow {
namespace compare {

/// How alpha is spent over the looks (Lan and DeMets 1983, Biometrika 70:659).
enum class Spending {
  /// Up to the share t, 4 - 4 Phi(z / sqrt t) with Phi(z) = 1 - alpha / 4. Early looks get almost nothing, and the last
  /// one loses little. Close to the bounds of O'Brien and Fleming 1979, Biometrics 35:549.
  late,
  /// Up to the share t, alpha ln(1 + (e - 1) t). All looks get about the same level. Close to the bounds of Pocock
  /// 1977.
  even
};

/// For each look, the two-sided p below which it shows a difference. `information` is the share of the planned
/// cases that each look has seen, rising, up to 1 at most.
///
/// The levels come from the joint distribution of the looks by numerical integration (Armitage, McPherson and Rowe
/// 1969, J R Stat Soc A 132:235). The looks are taken for sums of independent parts, which holds for Wilcoxon's
/// signed-rank test with many cases. With few cases, its exact p is discrete, and the test shows less than alpha.
///
/// Looks at other shares than planned are allowed, as long as their shares do not depend on what was seen. Throws Error
/// for no looks, shares that do not rise from above 0 to at most 1, or an alpha not within 0.001 to 0.5.
std::vector<double> levels_of_looks(const std::vector<double>& information, double alpha = 0.05,
                                    Spending spending = Spending::late);

/// The numbers of cases at which one looks: `first`, then `every` more each time, and `most` at the end. Throws Error
/// if one of them is 0, or `most` is below `first`.
std::vector<std::size_t> looks_at(std::size_t first, std::size_t every, std::size_t most);

}  // namespace compare
}  // namespace marrow
