// SPDX-License-Identifier: Apache-2.0
#pragma once
// Checks for projectors whose radiographs have derivatives.
#include <vector>

#include "marrow/conformance.hpp"

namespace marrow::conformance {

std::vector<Check> derivative_checks();

}  // namespace marrow::conformance
