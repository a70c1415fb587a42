// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// What is wrong with a name that a person chose for an item (a view, a fragment, a point); "" if the name is good. A
/// good name has 1 to 100 bytes of UTF-8 without control characters. It becomes part of logs, tables and file names.
/// Characters that a file name cannot have are escaped when the file is named.
std::string fault_of_item_name(const std::string& name);

/// Throws Error if fault_of_item_name() finds a fault. `what` says what the name belongs to ("view").
void check_item_name(const std::string& what, const std::string& name);

/// The known name with the least edit distance to `wrong`, if it is near enough for a typing error; else "". Names of
/// more than 100 bytes are never near.
std::string nearest_name(const std::string& wrong, const std::vector<std::string>& known);

/// "did you mean 'x'?" if a known name is near; else "known: a, b, c" with the first 20 names, or "there are none".
std::string suggestion(const std::string& wrong, const std::vector<std::string>& known);

}  // namespace marrow
