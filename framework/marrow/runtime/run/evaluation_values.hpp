// SPDX-License-Identifier: Apache-2.0
#pragma once
// Helpers for values, shared by the parts of Evaluation.
#include <string>

#include "marrow/runtime/run/executor.hpp"

namespace marrow {

/// Calls visit(item) for each single value in `value`, in order. Goes into lists.
template <class V, class Visit>
void for_leaves(V& value, const Visit& visit) {
  if (!value.is_list()) return visit(value);
  for (auto& item : value.items) for_leaves(item, visit);
}

/// Thrown if an input cannot be made because the node that makes it failed or was not run.
struct MissingInput {
  NodeRecord::Status status;
  std::string missing;
};

}  // namespace marrow
