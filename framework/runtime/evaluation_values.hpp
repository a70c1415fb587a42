// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the parts of Evaluation share about values.
#include <string>

#include "marrow/runtime/executor.hpp"

namespace marrow {

/// Calls visit(item) for each single value in `value`, lists taken apart, in order.
template <class V, class Visit>
void for_leaves(V& value, const Visit& visit) {
  if (!value.is_list()) return visit(value);
  for (auto& item : value.items) for_leaves(item, visit);
}

/// Thrown where an input cannot be made because its own node failed.
struct MissingInput {
  NodeRecord::Status status;
  std::string missing;
};

}  // namespace marrow
