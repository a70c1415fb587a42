// SPDX-License-Identifier: Apache-2.0
// Adds to predicted deviations what is not known about the cameras, as their files state it (docs/case.md). Where two
// cameras contradict each other, only refine.cameras finds by how much; here the pose takes what least squares give it.
#include <Eigen/Geometry>
#include <cmath>

#include "marrow/deviations/outline_errors.hpp"
#include "marrow/toolbox/geometry/camera_deviations.hpp"

namespace {

using namespace marrow;
using deviations::OutlineError, deviations::OutlineRow;
using geometry::CameraDeviations;

/// Each parameter of a camera that is not exact, and how an error of one unit moves the image along the outline's
/// normals. The camera turns about the point `centre_mm` of its own frame.
std::vector<OutlineError> errors_of(const CameraDeviations& stated, const Eigen::Vector3d& centre_mm) {
  std::vector<OutlineError> all{
      {stated.focal_percent.value_or(0),
       [](const OutlineRow& r) { return 0.01 * (r.normal_u * r.from_middle_u + r.normal_v * r.from_middle_v); }},
      {stated.centre_px.value_or(0) / std::sqrt(2.0), [](const OutlineRow& r) { return r.normal_u; }},
      {stated.centre_px.value_or(0) / std::sqrt(2.0), [](const OutlineRow& r) { return r.normal_v; }},
      {stated.source_mm.value_or(0), [](const OutlineRow& r) { return r.by_camera_px_per_mm.z(); }}};
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(axis);
    all.push_back({stated.shift_mm.value_or(0) / std::sqrt(3.0),
                   [unit](const OutlineRow& r) { return r.by_camera_px_per_mm.dot(unit); }});
    all.push_back({radians(stated.turn_deg.value_or(0)) / std::sqrt(3.0), [unit, centre_mm](const OutlineRow& r) {
                     return r.by_camera_px_per_mm.dot(unit.cross(r.in_camera_mm - centre_mm));
                   }});
  }
  std::erase_if(all, [](const OutlineError& error) { return error.deviation == 0; });
  return all;
}

deviations::Widened with_cameras(const List<Pose>& stages, const OutlineProjector& projector, const List<View>& views,
                                 const List<CameraDeviations>& stated, Context& context) {
  if (stated.names() != views.names())
    throw Error("camera_deviations and views are not of the same views; wire both from the node that reads the views");
  bool is_stated = false;
  for (const CameraDeviations& camera : stated) is_stated = is_stated || !camera.is_none();
  const auto by_cameras = [&](const Pose& pose) -> std::optional<Matrix6d> {
    if (!is_stated) return Matrix6d::Zero();
    const auto fit = deviations::OutlineFit::of(views, projector, pose);
    if (!fit) return std::nullopt;
    return fit->covariance([&](std::size_t v) {
      return errors_of(stated[v], views[v].camera.camera_from_world * (pose.world_from_model * pose.frame.origin_mm));
    });
  };
  return deviations::widened(stages, by_cameras, "what is not known about the cameras is not added", context);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("deviations.cameras", with_cameras)
      .summary("Adds to predicted deviations what is not known about the cameras, as their files state it")
      .in("stages", "poses of a search", over("stage"))
      .in("projector", "draws the bone's outline")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .in("camera_deviations", "what is stated about each camera, as a camera file says it", over("view"))
      .out("pose", &deviations::Widened::pose,
           "the last pose; a covariance that is absent or not finite stays as it is")
      .out("stages", &deviations::Widened::stages, "all poses; they stay as they are if nothing is stated",
           over("stage"));
}
