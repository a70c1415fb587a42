// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/runtime/node/value.hpp"

namespace MARROW_EXPORT marrow {

/// What is wrong with a value of marrow's own types, in words. Empty if the value is sound or absent. `value` is not a
/// list. Nodes rely on the sizes of a value: with wrong sizes they would read beyond its end. A pose must be rigid and
/// its covariance valid (check_pose()), because a negative variance would look like a deviation of 0.
std::string fault_of_value(const Value& value);

/// Whether an output may have a figure of this name: PortInfo::figures is empty, or one of its patterns describes the
/// name. In a pattern, * stands for any text.
bool may_have_figure(const PortInfo& port, const std::string& name);
/// The first figure of the value that its output may not have, in words; empty if there is none.
std::string fault_of_figures(const PortInfo& port, const Value& value);

}  // namespace marrow
