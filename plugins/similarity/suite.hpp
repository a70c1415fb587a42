// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What costs must do.
Suite similarity_suite();

}  // namespace marrow::conformance
