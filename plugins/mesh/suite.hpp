// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What meshers must do.
Suite mesh_suite();

}  // namespace marrow::conformance
