// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/runtime/value.hpp"

namespace marrow {

/// What is wrong with the sizes of a value of marrow's own types, in words: nodes that take it rely on them, and would
/// read beyond its end. An empty text for a sound value and for one that is not here. `value` is no list.
std::string fault_of_sizes(const Value& value);

}  // namespace marrow
