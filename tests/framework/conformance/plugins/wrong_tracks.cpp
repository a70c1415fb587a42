// SPDX-License-Identifier: Apache-2.0
// A plain node that follows a bone, and others that are wrong in one way each: the suite must catch each of them.
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

using marrow::List;
using marrow::Pose;

enum class Fault { none, lagging, drifting, shaking, renamed, careless, changing, averaging, rounding, one_sided };

/// The pose of frame i as the fault has it.
template <Fault kFault>
Pose followed(const List<Pose>& poses, std::size_t i) {
  Pose pose = poses[i];
  Eigen::Vector3d& at_mm = pose.world_from_model.translation_mm;
  if (kFault == Fault::lagging) return poses[i < 5 ? 0 : i - 5];
  if (kFault == Fault::drifting) at_mm.x() += 0.002 * double(i);
  if (kFault == Fault::shaking) at_mm.y() += i % 2 ? 1 : -1;
  if (kFault == Fault::rounding) at_mm = (at_mm * 10).array().round() / 10;
  if (kFault == Fault::one_sided && i == 0) at_mm.z() += 2;
  if (kFault == Fault::averaging) {
    const std::size_t low = i < 2 ? 0 : i - 2, high = std::min(i + 3, poses.size());
    at_mm.setZero();
    for (std::size_t k = low; k < high; ++k) at_mm += poses[k].world_from_model.translation_mm / double(high - low);
  }
  return pose;
}

template <Fault kFault>
List<Pose> track(const List<Pose>& poses) {
  static int calls = 0;
  List<Pose> result;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (kFault != Fault::careless) marrow::check_pose(poses[i], "a pose");
    Pose pose = followed<kFault>(poses, i);
    if (kFault == Fault::changing) pose.cost = ++calls;
    result.add(kFault == Fault::renamed ? "frame " + poses.name(i) : poses.name(i), pose);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .in("poses", "measured poses", marrow::over("frame"))
        .out("poses", "better poses", marrow::over("frame"));
  };
  add("track.plain", track<Fault::none>);
  add("track.lagging", track<Fault::lagging>);
  add("track.drifting", track<Fault::drifting>);
  add("track.shaking", track<Fault::shaking>);
  add("track.renamed", track<Fault::renamed>);
  add("track.careless", track<Fault::careless>);
  add("track.changing", track<Fault::changing>);
  add("track.averaging", track<Fault::averaging>);
  add("track.rounding", track<Fault::rounding>);
  add("track.one_sided", track<Fault::one_sided>);
}
