// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/runtime/plugins/catalogue.hpp"

namespace marrow::cli {

/// The sentence in which a node with the trait "device" says which device it would compute on, or why there is none
/// (docs/plugins.md). Empty for other nodes, whose libraries are not loaded. Throws Error if the library cannot be
/// loaded.
std::string device_text(const std::string& node, const Catalogue& catalogue);

}  // namespace marrow::cli
