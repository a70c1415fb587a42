// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/geometry/targets.hpp"

namespace {

using namespace marrow;

Metrics reduced(const List<Truth>& truths, const List<Mesh>& models, const geometry::FragmentPair& options) {
  const auto place_of = [&](const std::string& fragment) -> const RigidTransform& {
    return geometry::of_fragment(truths, fragment, "exact pose").world_from_model;
  };
  const RigidTransform &moved = place_of(options.moved), &reference = place_of(options.reference);
  geometry::check_poses(moved, reference, "pose of '" + options.reference + "'");
  const Mesh& model = geometry::of_fragment(models, options.moved, "surface");
  const Vector6d motion = motion_between(reference, moved, fragment_frame(model));
  return {{{"rotation_deg", degrees(geodesic_angle_rad(moved.rotation, reference.rotation)), "deg"},
           {"axial_deg", degrees(motion[2]), "deg"},
           {"translation_mm", motion.tail<3>().norm(), "mm"},
           {"along_mm", motion[5], "mm"}}};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.reduced", reduced)
      .summary("How far a fragment is from its place in the restored bone, by the exact poses")
      .in("truths", "exact poses of both fragments", over("fragment"))
      .in("models", "surfaces of both fragments; the moved one gives the axes and the centroid", over("fragment"))
      .out("metrics",
           "rotation angle (geodesic), signed rotation about the long axis, shift of the centroid and its signed part "
           "along the long axis")
      .figures({"rotation_deg", "axial_deg", "translation_mm", "along_mm"})
      .option("moved", &geometry::FragmentPair::moved, "fragment that is moved")
      .option("reference", &geometry::FragmentPair::reference, "fragment that stays");
}
