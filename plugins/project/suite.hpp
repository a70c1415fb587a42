// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What projectors must do.
Suite project_suite();

}  // namespace marrow::conformance
