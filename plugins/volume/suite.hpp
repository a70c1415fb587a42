// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every node of the kind volume must pass.
Suite volume_suite();

}  // namespace marrow::conformance
