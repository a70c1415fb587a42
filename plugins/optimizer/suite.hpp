// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every optimizer must pass.
Suite optimizer_suite();

}  // namespace marrow::conformance
