// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/runtime/value.hpp"

namespace marrow {

/// What is wrong with a value of marrow's own types, in words. Nodes that take it rely on its sizes, and would read
/// beyond its end. A pose must be rigid, and its covariance one that exists (check_pose()): a negative variance would
/// pass for a deviation of 0. An empty text for a sound value and for one that is not here. `value` is no list.
std::string fault_of_value(const Value& value);

}  // namespace marrow
