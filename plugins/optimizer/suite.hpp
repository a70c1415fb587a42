// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What optimizers must do.
Suite optimizer_suite();

}  // namespace marrow::conformance
