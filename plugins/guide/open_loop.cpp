// SPDX-License-Identifier: Apache-2.0
// One move that reduces the fracture. The robot's place in the images is calibrated before, with a target on its hand.
#include <marrow/plugin.hpp>

#include "marrow/domain/number_text.hpp"
#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/robot/hand_eye.hpp"

namespace {

using namespace marrow;

struct Options : geometry::FragmentPair {
  std::string method = "ax_zb";
};

struct Result {
  Pose motion;
  Metrics figures;
};

/// The robot's base in the world, from AX = ZB over all stations, or from AX = XB over the motions between each two.
RigidTransform base_from_world(const List<Pose>& hands, const List<Pose>& targets, const std::string& method) {
  if (hands.names() != targets.names())
    throw Error("poses of the hand and of the target are not of the same stations: there are " +
                std::to_string(hands.size()) + " and " + std::to_string(targets.size()));
  std::vector<robot::Station> stations;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    check_rigid(hands[i].world_from_model, "the hand at " + hands.name(i));
    check_rigid(targets[i].world_from_model, "the target at " + hands.name(i));
    robot::Station station;
    station.base_from_hand.rotation = hands[i].world_from_model.rotation;
    station.base_from_hand.translation_mm = hands[i].world_from_model.translation_mm;
    station.world_from_target = targets[i].world_from_model;
    stations.push_back(station);
  }
  if (method == "ax_zb") return robot::solve_ax_zb(stations).base_from_world;
  std::vector<robot::Move> moves;
  for (std::size_t i = 0; i < stations.size(); ++i)
    for (std::size_t j = i + 1; j < stations.size(); ++j)
      moves.push_back({stations[j].base_from_hand * inverse(stations[i].base_from_hand),
                       stations[j].world_from_target * inverse(stations[i].world_from_target),
                       Eigen::Vector3d::Zero()});
  return robot::solve_ax_xb(moves);
}

Result open_loop(const List<Pose>& poses, const List<Pose>& hands, const List<Pose>& targets, const Options& options,
                 Context& context) {
  const Pose &moved = geometry::pose_of(poses, options.moved), &reference = geometry::pose_of(poses, options.reference);
  const RigidTransform base = base_from_world(hands, targets, options.method);
  const RigidTransform wanted = reference.world_from_model * inverse(moved.world_from_model);
  Result result;
  result.motion.world_from_model = base * wanted * inverse(base);
  result.motion.world_from_model.target = result.motion.world_from_model.source = "robot";
  const Eigen::Vector3d middle = moved.world_from_model * moved.frame.origin_mm;
  const double turn = degrees(vector_from_rotation(wanted.rotation).norm()), shift = (wanted * middle - middle).norm();
  result.figures.items = {{"step_deg", turn, "deg"},
                          {"step_mm", shift, "mm"},
                          {"stations", double(hands.size()), ""},
                          {"images", double(hands.size()) + 2, ""}};
  const std::string text = formatted("one move of %.2f degrees and %.2f mm", turn, shift);
  context.info(text);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.open_loop", open_loop)
      .summary("One move to the fragment's place, by a robot whose place is calibrated with a target on its hand")
      .in("poses", "poses of both fragments in the images", over("fragment"))
      .in("hands", "poses of the robot's hand in its base, at each station", over("station"))
      .in("targets", "poses of the target in the world, at each station", over("station"))
      .out("motion", &Result::motion, "motion in the axes of the robot's base")
      .out("figures", &Result::figures, "size of the motion, and the number of images")
      .option("moved", &Options::moved, "fragment that the robot holds")
      .option("reference", &Options::reference, "fragment that stays")
      .option("method", &Options::method,
              "the robot's place from AX = ZB (all stations) or from AX = XB (motions between stations)",
              one_of({"ax_zb", "ax_xb"}));
}
