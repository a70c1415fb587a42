// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// Checks that no pose can be found by a cost that has nothing to compare.
std::vector<Check> silence_checks();

}  // namespace marrow::conformance
