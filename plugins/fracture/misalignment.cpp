// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"

namespace {

using marrow::degrees;
using marrow::geometry::displacement;
using marrow::geometry::FragmentPair;
using marrow::geometry::pose_of;

/// +1 if the long axis of the moved fragment points to the other fragment, else -1.
double towards_the_other(const marrow::Pose& moved, const marrow::Pose& reference) {
  return moved.frame.axes.col(2).dot(reference.frame.origin_mm - moved.frame.origin_mm) >= 0 ? 1 : -1;
}

marrow::Metrics misalignment(const marrow::List<marrow::Pose>& poses, const FragmentPair& options) {
  const marrow::Vector6d motion = displacement(poses, options);
  const double along = towards_the_other(pose_of(poses, options.moved), pose_of(poses, options.reference)) * motion[5];
  return {{{"angulation_frontal_axis_deg", degrees(motion[0]), "deg"},
           {"angulation_lateral_axis_deg", degrees(motion[1]), "deg"},
           {"angulation_deg", degrees(std::hypot(motion[0], motion[1])), "deg"},
           {"malrotation_deg", degrees(motion[2]), "deg"},
           {"shift_frontal_mm", motion[3], "mm"},
           {"shift_lateral_mm", motion[4], "mm"},
           {"shift_mm", std::hypot(motion[3], motion[4]), "mm"},
           {"shortening_mm", along, "mm"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("fracture.misalignment", misalignment)
      .summary(
          "Angulation, malrotation, shift and shortening of one fragment relative to another, compared with the CT, "
          "where both fragments are in place")
      .in("poses", "poses of both fragments", marrow::over("fragment"))
      .out("metrics",
           "rotations about and shifts along the moved fragment's own axes; shortening is positive if the fragments "
           "overlap")
      .option("moved", &FragmentPair::moved, "fragment whose misalignment is computed")
      .option("reference", &FragmentPair::reference, "fragment that counts as being in place");
}
