// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/geometry/implant.hpp"

#include <cmath>
#include <set>

#include "marrow/base/number_text.hpp"

namespace marrow::geometry {

Eigen::Vector3d unit_axis(const Eigen::Vector3d& axis, const std::string& what, const std::string& hole) {
  const double length = axis.norm();
  if (!(length > 1e-9) || !std::isfinite(length))
    throw Error(
        formatted("{}: the axis of hole '{}' has the length {:f}, so it has no direction; give the direction of the "
                  "hole, such as [1, 0, 0]",
                  what, hole, length));
  return axis / length;
}

void check_implant(const Implant& implant, const std::string& what) {
  check_closed_surface(implant.surface, what);
  if (implant.holes.empty())
    throw Error(what + ": the implant has no holes, so there is nothing to lock; give each hole's centre and axis");
  std::set<std::string> names;
  for (const Hole& hole : implant.holes) {
    if (!names.insert(hole.name).second) throw Error(what + ": two holes are named '" + hole.name + "'; rename one");
    if (!hole.centre_mm.allFinite()) throw Error(what + ": the centre of hole '" + hole.name + "' is not finite");
    if (std::abs(unit_axis(hole.axis, what, hole.name).dot(hole.axis) - 1) > 1e-6)
      throw Error(
          formatted("{}: the axis of hole '{}' must have length 1, got {:f}", what, hole.name, hole.axis.norm()));
    if (!(hole.diameter_mm > 0) || !std::isfinite(hole.diameter_mm))
      throw Error(
          formatted("{}: the diameter of hole '{}' must be above 0 mm, got {:f}", what, hole.name, hole.diameter_mm));
  }
}

}  // namespace marrow::geometry
