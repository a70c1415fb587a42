// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What shaft nodes must do.
Suite shaft_suite();

}  // namespace marrow::conformance
