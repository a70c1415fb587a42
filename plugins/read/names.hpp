// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow::read {

/// What is wrong with a name that people choose for a view, a fragment or a point, which becomes part of file names, logs
/// and tables: "" where it is good. Good are at most 100 bytes of printable characters in UTF-8; what no file name may hold
/// is escaped where files are named.
std::string fault_of_name(const std::string& name);

/// Throws Error where the name of an item on the axis `what` ("view") is not good.
void check_name(const std::string& what, const std::string& name);

}  // namespace marrow::read
