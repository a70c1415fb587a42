// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// Checks for nodes of the kind `verdict`.
Suite verdict_suite();

}  // namespace marrow::conformance
