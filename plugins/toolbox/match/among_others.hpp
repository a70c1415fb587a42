// SPDX-License-Identifier: Apache-2.0
#pragma once
// Costs that depend on where other bones are.
#include <memory>

#include "marrow/domain/functions.hpp"
#include "marrow/domain/list.hpp"

namespace marrow::match {

/// What a cost is besides a Cost if other bones count in it: their radiographs, or their surfaces. Such a cost is made
/// for known poses of the others, and can be made again for others.
class CostAmongOthers {
 public:
  virtual ~CostAmongOthers() = default;
  /// The same cost at the same level, with the other bones in these poses. Bones are found by their names: a bone that
  /// is not in the list stays where it is, and names that the cost does not know are ignored. Null if the other bones
  /// do not count. The cost refers to what the first one refers to, but not to the first one. Safe to call from several
  /// threads at once.
  virtual std::shared_ptr<const Cost> with_others(const List<RigidTransform>& world_from_others) const = 0;
};

/// with_others() of a cost; null if other bones do not count in it.
inline std::shared_ptr<const Cost> among_others(const Cost& cost, const List<RigidTransform>& world_from_others) {
  const auto* among = dynamic_cast<const CostAmongOthers*>(&cost);
  return among ? among->with_others(world_from_others) : nullptr;
}

}  // namespace marrow::match
