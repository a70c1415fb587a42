// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace marrow {

/// What is wrong with a name that people choose for an item: a view, a fragment, a point. "" where it is good. The name
/// becomes part of file names, logs and tables. Good are 1 to 100 bytes of UTF-8 without control characters. What no
/// file name may hold is escaped where files are named.
std::string fault_of_item_name(const std::string& name);

/// Throws Error where the name of an item is not good; `what` says whose it is ("view").
void check_item_name(const std::string& what, const std::string& name);

/// The name nearest to `wrong` (by edit distance, where it is near enough to be a slip), else an empty string. Names of
/// more than 100 bytes are near to none.
std::string nearest_name(const std::string& wrong, const std::vector<std::string>& known);

/// "did you mean 'x'?" or, when nothing is near, "known: a, b, c".
std::string suggestion(const std::string& wrong, const std::vector<std::string>& known);

}  // namespace marrow
