// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What cameras must do.
Suite camera_suite();

}  // namespace marrow::conformance
