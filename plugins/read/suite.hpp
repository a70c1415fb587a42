// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/conformance.hpp"

namespace marrow::conformance {

/// The checks of nodes that read one file, which their option `path` names.
Suite read_suite();

}  // namespace marrow::conformance
