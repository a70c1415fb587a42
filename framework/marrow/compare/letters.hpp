// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// Groups of a ranking as letters (the compact letter display; Piepho 2004, J Comput Graph Stat 13:456): two things
/// share a letter if and only if no test tells them apart. `different` holds the pairs that a test tells apart. The
/// first thing has "a", and letters follow in the order of the first thing that has them.
///
/// Groups are the largest sets of which no pair differs. Nothing if there are more of them than letters, which is so
/// only if many pairs differ in a pattern that is no order. Throws Error for a pair that names a thing that is not
/// there, or one thing twice.
std::optional<std::vector<std::string>> letters_of_groups(
    std::size_t things, const std::vector<std::pair<std::size_t, std::size_t>>& different);

}  // namespace compare
}  // namespace marrow
