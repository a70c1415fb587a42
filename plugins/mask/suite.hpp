// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every node that masks views must pass.
Suite mask_suite();

}  // namespace marrow::conformance
