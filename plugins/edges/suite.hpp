// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// What edge extractors must do.
Suite edges_suite();

}  // namespace marrow::conformance
