// SPDX-License-Identifier: Apache-2.0
#pragma once
// A bone in two X-ray views, for any node that takes ordinary values.
#include <map>
#include <marrow/runtime/plugins/catalogue.hpp>
#include <string>
#include <vector>

#include "shipped.hpp"
#include "tests/properties/moved_world_values.hpp"

namespace moved_world {

/// Everything that a node may ask for, after a change.
class Scene {
 public:
  Scene(const Change& change, int views);
  /// The value for an input: by its name, else by its type. Absent if the scene has none.
  marrow::Value value_for(const marrow::PortInfo& port) const;

 private:
  void add_projectors_and_costs();

  std::map<std::string, marrow::Value> values_;  ///< by "type", "type list", "type name" and "type list name"
};

/// Poses within some degrees and mm of the true one, at which costs are compared.
std::vector<marrow::RigidTransform> poses_to_compare();

}  // namespace moved_world
