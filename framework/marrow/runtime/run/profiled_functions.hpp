// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/runtime/node/value.hpp"
#include "marrow/runtime/run/profile.hpp"

namespace marrow {

/// Replaces the functions in a value by ones that call them, with a bar for each call: outlines, radiographs, and the
/// values of a function that an optimizer minimises. Costs stay as they are, and so do functions whose class code
/// elsewhere may look for by dynamic_cast, which would not find it any more. `node` made the value.
MARROW_EXPORT_TO_TESTS void show_calls(Value& value, const ProfilePlace& place, const std::string& node,
                                       const std::string& item);

}  // namespace marrow
