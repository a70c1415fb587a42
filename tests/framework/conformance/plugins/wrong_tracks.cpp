// SPDX-License-Identifier: Apache-2.0
// A plain node that follows a bone, and others that are wrong in one way each: the suite must catch each of them.

#include "wrong.hpp"

namespace {

using marrow::List;
using marrow::Pose;

/// The pose of frame i as the fault has it.
template <wrong::Fault fault>
Pose followed(const List<Pose>& poses, std::size_t i) {
  Pose pose = poses[i];
  Eigen::Vector3d& at_mm = pose.world_from_model.translation_mm;
  if (fault == "lagging") return poses[i < 5 ? 0 : i - 5];
  if (fault == "drifting") at_mm.x() += 0.002 * double(i);
  if (fault == "shaking") at_mm.y() += i % 2 ? 1 : -1;
  if (fault == "rounding") at_mm = (at_mm * 10).array().round() / 10;
  if (fault == "one_sided" && i == 0) at_mm.z() += 2;
  if (fault == "averaging") {
    const std::size_t low = i < 2 ? 0 : i - 2, high = std::min(i + 3, poses.size());
    at_mm.setZero();
    for (std::size_t k = low; k < high; ++k) at_mm += poses[k].world_from_model.translation_mm / double(high - low);
  }
  return pose;
}

template <wrong::Fault fault>
List<Pose> track(const List<Pose>& poses) {
  List<Pose> result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!(fault == "careless")) marrow::check_pose(poses[i], "a pose");
    Pose pose = followed<fault>(poses, i);
    if (fault == "changing") pose.cost = wrong::next_call();
    result.add(fault == "renamed" ? "frame " + poses.name(i) : poses.name(i), pose);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "lagging", "drifting", "shaking", "renamed", "careless", "changing", "averaging", "rounding",
                 "one_sided">(
      plugin, "track", []<wrong::Fault fault>() { return &track<fault>; },
      [](auto&& node) {
        node.in("poses", "measured poses", marrow::over("frame")).out("poses", "better poses", marrow::over("frame"));
      });
}
