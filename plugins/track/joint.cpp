// SPDX-License-Identifier: Apache-2.0
// The motion of a joint between two bones of the same CT: angles and shifts by Grood and Suntay (J Biomech Eng 105,
// 1983), and the turn about the helical axis since the first frame. The bones' axes are the CT's own directions, right,
// front and up, so all figures are zero in the posture of the CT.
#include <Eigen/Geometry>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::TrackState;

struct Options {
  std::array<double, 3> centre_mm{0, 0, 0};
  std::array<double, 3> right{-1, 0, 0};
  std::array<double, 3> up{0, 0, 1};
};

/// Columns: right, front, up, in the CT.
Eigen::Matrix3d anatomical_axes(const Options& options) {
  const Eigen::Vector3d right = Eigen::Vector3d::Map(options.right.data()),
                        up = Eigen::Vector3d::Map(options.up.data());
  const Eigen::Vector3d front = up.cross(right);
  if (!(front.norm() > 1e-6 * right.norm() * up.norm()) || !right.allFinite() || !up.allFinite())
    throw Error("'right' and 'up' must be two different directions of the CT");
  Eigen::Matrix3d axes;
  axes.col(0) = right.normalized();
  axes.col(1) = front.normalized();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

Metrics motion_of(const RigidTransform& proximal, const RigidTransform& distal, const RigidTransform& first,
                  const Eigen::Matrix3d& axes, const Eigen::Vector3d& centre_mm) {
  const Eigen::Matrix3d of_proximal = proximal.rotation * axes, of_distal = distal.rotation * axes;
  const Eigen::Vector3d right = of_proximal.col(0), up = of_distal.col(2), floating = up.cross(right).normalized();
  const Eigen::Vector3d apart_mm = distal * centre_mm - proximal * centre_mm;
  const RigidTransform since = inverse(proximal) * distal * inverse(first);
  const Eigen::Vector3d turn = vector_from_rotation(since.rotation);
  const Eigen::Vector3d helical = turn.norm() > 1e-9 ? Eigen::Vector3d(turn.normalized()) : Eigen::Vector3d::Zero();
  Metrics metrics;
  metrics.items = {
      {"flexion_deg", degrees(std::atan2(-floating.dot(of_proximal.col(2)), floating.dot(of_proximal.col(1)))), "deg"},
      {"adduction_deg", 90 - degrees(std::acos(std::clamp(right.dot(up), -1.0, 1.0))), "deg"},
      {"internal_rotation_deg", degrees(std::atan2(floating.dot(of_distal.col(0)), floating.dot(of_distal.col(1)))),
       "deg"},
      {"right_mm", apart_mm.dot(right), "mm"},
      {"front_mm", apart_mm.dot(floating), "mm"},
      {"distraction_mm", -apart_mm.dot(up), "mm"},
      {"helical_deg", degrees(turn.norm()), "deg"},
      {"helical_shift_mm", since.translation_mm.dot(helical), "mm"},
  };
  return metrics;
}

List<Metrics> joint(const List<TrackState>& proximal, const List<TrackState>& distal, const Options& options) {
  if (proximal.names() != distal.names())
    throw Error(formatted("the two bones are not followed through the same frames: there are {} and {}",
                          proximal.size(), distal.size()));
  const Eigen::Matrix3d axes = anatomical_axes(options);
  const Eigen::Vector3d centre_mm = Eigen::Vector3d::Map(options.centre_mm.data());
  List<Metrics> result;
  std::optional<RigidTransform> first;
  for (std::size_t i = 0; i < proximal.size(); ++i) {
    const RigidTransform &of_proximal = proximal[i].now.world_from_model, &of_distal = distal[i].now.world_from_model;
    if (!first) first = inverse(of_proximal) * of_distal;
    result.add(proximal.name(i), motion_of(of_proximal, of_distal, *first, axes, centre_mm));
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.joint", joint)
      .summary("Angles and shifts between two bones, frame by frame (Grood and Suntay; helical axis)")
      .in("proximal", "the upper bone after each frame", over("frame"))
      .in("distal", "the lower bone after each frame, of the same CT", over("frame"))
      .out("metrics",
           "flexion, adduction and internal rotation of a right joint (of a left one, the last two change sign); "
           "shifts of the lower bone to the right, to the front and apart; turn about and shift along the helical axis "
           "since the first frame",
           over("frame"))
      .figures({"flexion_deg", "adduction_deg", "internal_rotation_deg", "right_mm", "front_mm", "distraction_mm",
                "helical_deg", "helical_shift_mm"})
      .option("centre_mm", &Options::centre_mm, "point of the joint in the CT, whose shift is given")
      .option("right", &Options::right, "direction to the patient's right in the CT", unit(""))
      .option("up", &Options::up, "direction to the patient's head in the CT", unit(""));
}
