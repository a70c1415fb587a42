// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow::read {

/// What is wrong with a name that people choose for a view or a fragment, which becomes part of file names, logs and
/// tables: "" where it is good. Good are at most 100 bytes of printable characters in UTF-8, without '/' and '\', not
/// beginning with '.'.
std::string fault_of_name(const std::string& name);
/// The same for the name of a point, which is only shown: it may have any printable character.
std::string fault_of_label(const std::string& name);

/// Throws Error where the name of an item on the axis `what` ("view") is not good.
void check_name(const std::string& what, const std::string& name);

}  // namespace marrow::read
