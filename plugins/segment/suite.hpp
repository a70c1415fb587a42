// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What segmenters must do.
Suite segment_suite();

}  // namespace marrow::conformance
