// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// What is wrong with a value of marrow's own types, in words. Nodes that take it rely on its sizes, and would read
/// beyond its end. A pose must be rigid, and its covariance one that exists (check_pose()): a negative variance would
/// pass for a deviation of 0. An empty text for a sound value and for one that is not here. `value` is no list.
std::string fault_of_value(const Value& value);

/// Whether an output of figures may have one of this name: it is among PortInfo::figures, in which * stands for any
/// text, or nothing is known about them.
bool may_have_figure(const PortInfo& port, const std::string& name);
/// The first figure of the value that its output may not have, in words; empty if there is none.
std::string fault_of_figures(const PortInfo& port, const Value& value);

}  // namespace marrow
