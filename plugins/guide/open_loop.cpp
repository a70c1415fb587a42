// SPDX-License-Identifier: Apache-2.0
// One move that reduces the fracture. Before it, the robot's place is calibrated with a target on its hand.
#include <marrow/plugin.hpp>

#include "marrow/guide/servo.hpp"
#include "marrow/toolbox/geometry/fragments.hpp"

namespace {

using namespace marrow;

struct Options : geometry::FragmentPair {
  std::string method = "ax_zb";
  double max_deviation_deg = 2, max_deviation_mm = 2;
};

struct Result {
  Pose motion;
  Metrics metrics;
};

/// The robot's base in the world, and the covariance of a small motion of the world about its origin.
struct Place {
  RigidTransform base_from_world;
  Matrix6d covariance;
};

std::vector<robot::Station> stations_of(const List<Pose>& hands, const List<Pose>& targets) {
  if (hands.names() != targets.names())
    throw Error(formatted("poses of the hand and of the target are not of the same stations: there are {} and {}",
                          hands.size(), targets.size()));
  std::vector<robot::Station> stations;
  for (std::size_t i = 0; i < hands.size(); ++i) {
    check_pose(hands[i], "the hand at " + hands.name(i));
    check_pose(targets[i], "the target at " + hands.name(i));
    robot::Station station;
    station.base_from_hand.rotation = hands[i].world_from_model.rotation;
    station.base_from_hand.translation_mm = hands[i].world_from_model.translation_mm;
    station.world_from_target = targets[i].world_from_model;
    stations.push_back(station);
  }
  return stations;
}

/// From AX = ZB over all stations, or from AX = XB over the motions between each two.
Place place_of(const std::vector<robot::Station>& stations, const std::string& method) {
  if (method == "ax_zb") {
    const robot::RobotWorld found = robot::solve_ax_zb(stations);
    return {found.base_from_world, found.covariance};
  }
  std::vector<robot::Move> moves;
  for (std::size_t i = 0; i < stations.size(); ++i)
    for (std::size_t j = i + 1; j < stations.size(); ++j)
      moves.push_back({stations[j].base_from_hand * inverse(stations[i].base_from_hand),
                       stations[j].world_from_target * inverse(stations[i].world_from_target),
                       Eigen::Vector3d::Zero()});
  const robot::HandEye found = robot::solve_ax_xb(moves);
  // The n (n - 1) / 2 motions between n stations share the noise of the stations. With independent noise, their
  // covariance would be 2 / (n + 1) times that of the stations.
  return {found.robot_from_reference, 0.5 * double(stations.size() + 1) * found.covariance};
}

/// Throws Error if the move would leave the fragment too far from its place.
void check_left(double left_deg, double left_mm, const Options& options) {
  if (left_deg <= options.max_deviation_deg && left_mm <= options.max_deviation_mm) return;
  throw Error(
      formatted("the stations do not tell well enough where the robot is: this move would leave the fragment {:.2f} "
                "degrees and {:.2f} mm from its place (one standard deviation), at most {:g} degrees and {:g} mm are "
                "allowed; turn the robot further between stations, about axes that are at least 30 degrees apart, or "
                "raise max_deviation_deg and max_deviation_mm",
                left_deg, left_mm, options.max_deviation_deg, options.max_deviation_mm));
}

Result open_loop(const List<Pose>& poses, const List<Pose>& hands, const List<Pose>& targets, const List<Mesh>* models,
                 const Options& options, Context& context) {
  const auto [moved, reference] = geometry::poses_of_pair(poses, options, models);
  const Place place = place_of(stations_of(hands, targets), options.method);
  const RigidTransform& base = place.base_from_world;
  const RigidTransform wanted = reference.world_from_model * inverse(moved.world_from_model);
  Result result;
  result.motion.world_from_model = base * wanted * inverse(base);
  result.motion.world_from_model.target = result.motion.world_from_model.source = "robot";
  const Eigen::Vector3d middle = moved.world_from_model * moved.frame.origin_mm;
  const double turn = degrees(vector_from_rotation(wanted.rotation).norm()), shift = (wanted * middle - middle).norm();
  const Matrix6d left = robot::left_by(wanted, place.covariance, wanted * middle);
  const double left_deg = degrees(guide::rotation_deviation_rad(left)), left_mm = guide::shift_deviation_mm(left);
  check_left(left_deg, left_mm, options);
  result.metrics.items = {{"step_deg", turn, "deg"},
                          {"step_mm", shift, "mm"},
                          {"left_deg", left_deg, "deg"},
                          {"left_mm", left_mm, "mm"},
                          {"stations", double(hands.size()), ""},
                          {"images", double(hands.size()) + 2, ""}};
  context.info(
      formatted("one move of {:.2f} degrees and {:.2f} mm; the robot's place is known so well that it leaves {:.2f} "
                "degrees and {:.2f} mm (one standard deviation)",
                turn, shift, left_deg, left_mm));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.open_loop", open_loop)
      .summary("One move to the fragment's place, by a robot whose place is calibrated with a target on its hand")
      .in("poses", "poses of both fragments in the images", over("fragment"))
      .in("hands", "poses of the robot's hand in its base, at each station", over("station"))
      .in("targets", "poses of the target in the world, at each station", over("station"))
      .in("models", "surfaces of both fragments; they give the centroid if a pose does not", over("fragment"))
      .out("motion", &Result::motion, "motion in the axes of the robot's base")
      .out("metrics", &Result::metrics,
           "size of the motion; how far the uncertainty of the robot's place leaves the fragment from its place "
           "(standard deviations in the worst direction); number of images")
      .figures({"step_deg", "step_mm", "left_deg", "left_mm", "stations", "images"})
      .option("moved", &Options::moved, "fragment that the robot holds")
      .option("reference", &Options::reference, "fragment that stays")
      .option("method", &Options::method,
              "the robot's place from AX = ZB (all stations) or from AX = XB (motions between stations)",
              one_of({"ax_zb", "ax_xb"}))
      .option("max_deviation_deg", &Options::max_deviation_deg,
              "a move that would leave the fragment's rotation less well known is an error", at_least(0))
      .option("max_deviation_mm", &Options::max_deviation_mm,
              "a move that would leave the fragment's middle less well known is an error", at_least(0));
}
