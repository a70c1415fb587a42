// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every node of the kind track must pass.
Suite track_suite();

}  // namespace marrow::conformance
