// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/plugins/catalogue.hpp"

namespace marrow::fuzz {

/// The nodes that pipelines may use here: those of the small plugin for tests of the runtime.
const Catalogue& nodes();

}  // namespace marrow::fuzz
