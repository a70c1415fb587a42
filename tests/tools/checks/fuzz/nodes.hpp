// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/plugins/catalogue.hpp"

namespace marrow::fuzz {

/// The nodes that pipelines may use here: those of the small plugin by which the runtime is tested.
const Catalogue& nodes();

}  // namespace marrow::fuzz
