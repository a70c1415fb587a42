// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every registration must pass.
Suite register_suite();

}  // namespace marrow::conformance
