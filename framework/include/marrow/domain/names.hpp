// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

namespace marrow {

/// What is wrong with a name that people choose for an item: a view, a fragment, a point. "" where it is good. The name
/// becomes part of file names, logs and tables. Good are 1 to 100 bytes of UTF-8 without control characters. What no
/// file name may hold is escaped where files are named.
std::string fault_of_item_name(const std::string& name);

/// Throws Error where the name of an item is not good; `what` says whose it is ("view").
void check_item_name(const std::string& what, const std::string& name);

}  // namespace marrow
