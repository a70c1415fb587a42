// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every node of the kind similarity must pass.
Suite similarity_suite();

/// Checks that no pose can be found by a cost that has nothing to compare.
std::vector<Check> silence_checks();

}  // namespace marrow::conformance
