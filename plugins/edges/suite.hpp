// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks that every edge extractor must pass.
Suite edges_suite();

}  // namespace marrow::conformance
