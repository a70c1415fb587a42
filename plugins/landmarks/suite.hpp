// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every node that finds landmarks must pass.
Suite landmarks_suite();

}  // namespace marrow::conformance
