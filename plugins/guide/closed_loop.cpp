// SPDX-License-Identifier: Apache-2.0
// Position-based visual servoing: brings the distal fragment to its place beside the proximal one. Both are found in
// the same images. Where the robot stands need not be known, because its moves show it.

#include "marrow/guide/servo.hpp"
#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/robotics/robot_state.hpp"

namespace {

using namespace marrow;
using guide::Leg, guide::RelativePose;
using robot::GuideState, robot::RobotReport;

struct Options : geometry::FragmentPair, guide::StepLimits, guide::ApproachOptions, robot::HandEyeNoise {
  std::string hand_eye = "estimated";
  double astray_mm = 12;
  double reduced_deg = 0.5, reduced_mm = 0.5;
  int max_pairs = 8;
  double max_deviation_deg = 2, max_deviation_mm = 2;
};

struct Result {
  GuideState state;
  Pose motion;
  Stop stop;
  List<Pose> predicted;
  Metrics metrics;
};

std::string shown(double value, const char* unit) { return formatted("{:.2f} {}", value, unit); }

/// The way that remains to the fragment's place in the restored bone.
struct Remaining {
  double rotation_deg, shift_mm;
  double deviation_deg, deviation_mm;

  Remaining(const RelativePose& pose, const Eigen::Vector3d& centre_mm)
      : rotation_deg(degrees(vector_from_rotation(pose.reference_from_fragment.rotation).norm())),
        shift_mm((pose.reference_from_fragment * centre_mm - centre_mm).norm()),
        deviation_deg(degrees(guide::rotation_deviation_rad(pose.covariance))),
        deviation_mm(guide::shift_deviation_mm(pose.covariance)) {}

  std::string in_words() const {
    return shown(rotation_deg, "degrees") + " and " + shown(shift_mm, "mm") + " remain, known to " +
           shown(deviation_deg, "degrees") + " and " + shown(deviation_mm, "mm");
  }
};

/// Why a pose cannot be relied on; empty if it can.
std::string why_not_trusted(const Pose& pose, const std::string& name, const List<Verdict>* verdicts) {
  if (!pose.covariance || !pose.covariance->allFinite())
    return "the pose of '" + name + "' is not trusted: the images do not determine it";
  const Verdict* verdict = verdicts ? verdicts->find(name) : nullptr;
  if (verdict && verdict->judgement == Judgement::wrong)
    return "the pose of '" + name + "' is not trusted" + (verdict->reasons.empty() ? "" : ": " + verdict->reasons[0]);
  return "";
}

/// Whether the last two pairs of images brought no progress. Near the end, this means that the way has not become
/// shorter by more than its deviation. Far from the end, where bones are held apart while they are rotated and aligned,
/// it means that the way has become longer. The first moves do not count: they may lead astray, because the robot's
/// place is not known yet.
bool brings_nothing(const std::vector<double>& errors, double deviation) {
  constexpr std::size_t kFirst = 5;
  constexpr double kNear = 4;  // tolerances
  const std::size_t count = errors.size();
  if (count < kFirst) return false;
  const double least = errors[count - 3] + (errors.back() < kNear ? -2 : 2) * deviation;
  return std::min(errors[count - 1], errors[count - 2]) > least;
}

Stop stop_of(const GuideState& state, const Remaining& remaining, const std::string& not_trusted,
             const RobotReport& report, const Options& options) {
  const double of_deg = remaining.rotation_deg / options.reduced_deg, of_mm = remaining.shift_mm / options.reduced_mm,
               deviation = remaining.deviation_deg / options.reduced_deg + remaining.deviation_mm / options.reduced_mm;
  if (!not_trusted.empty()) return {true, not_trusted};
  if (remaining.deviation_deg > options.max_deviation_deg || remaining.deviation_mm > options.max_deviation_mm)
    return {true, "the poses are not trusted: they are known to " + shown(remaining.deviation_deg, "degrees") +
                      " and " + shown(remaining.deviation_mm, "mm") + " only, at most " +
                      shown(options.max_deviation_deg, "degrees") + " and " + shown(options.max_deviation_mm, "mm") +
                      " are allowed"};
  if (of_deg + 2 * remaining.deviation_deg / options.reduced_deg < 1 &&
      of_mm + 2 * remaining.deviation_mm / options.reduced_mm < 1)
    return {true, "the fracture is reduced: " + remaining.in_words()};
  // More images show no more: the rest is less than one deviation.
  if (of_deg < 1 && of_mm < 1 && remaining.rotation_deg < remaining.deviation_deg &&
      remaining.shift_mm < remaining.deviation_mm)
    return {true, "the fragment is in its place as far as the images show: " + remaining.in_words()};
  constexpr int kMostStops = 4;
  if (state.stops >= kMostStops)
    return {true,
            formatted("the robot stopped {} times in a row: {}; {}", kMostStops, report.stopped, remaining.in_words())};
  if (brings_nothing(state.errors, deviation))
    return {true, "the way has not become shorter in two pairs of images: " + remaining.in_words()};
  if (state.pairs >= options.max_pairs)
    return {true,
            formatted("{} pairs of images are taken, no more are allowed: {}", state.pairs, remaining.in_words())};
  return {false, remaining.in_words()};
}

/// Learns from the last move.
void learn(GuideState& state, const RigidTransform& seen, const Eigen::Vector3d& centre_mm, const RobotReport& report) {
  const bool is_move = !report.done.rotation.isIdentity(1e-9) || !report.done.translation_mm.isZero(1e-6);
  if (state.seen && is_move) {
    const robot::Move move{report.done, seen * inverse(*state.seen), *state.seen * centre_mm};
    state.moves.push_back(move);
    const RigidTransform asked = inverse(state.guess) * move.told * state.guess;
    state.jacobian = guide::broyden(state.jacobian, guide::in_mm(guide::step_of(asked, move.centre_mm)),
                                    guide::in_mm(guide::step_of(move.seen, move.centre_mm)));
  }
  state.stops = report.stopped.empty() ? 0 : state.stops + 1;
  state.seen = seen;
}

/// The poses expected in the next pair of images. Their deviations grow with the motion and with the uncertainty of the
/// robot's place.
List<Pose> predicted(const List<Pose>& poses, const List<Mesh>& models, const RigidTransform& motion,
                     const Vector6d& step, const Matrix6d& hand_eye, const Options& options) {
  constexpr double kLeast_deg = 0.5, kLeast_mm = 1;
  const Pose& reference = geometry::pose_of(poses, options.reference);
  return poses.changed([&](Pose& pose, std::size_t i) {
    pose = geometry::with_own_axes(pose, poses.name(i), &models);
    double turn = radians(kLeast_deg), shift = kLeast_mm;
    if (poses.name(i) == options.moved) {
      RigidTransform in_ct = motion;
      in_ct.target = in_ct.source = reference.world_from_model.source;
      pose.world_from_model =
          reference.world_from_model * in_ct * inverse(reference.world_from_model) * pose.world_from_model;
      const double unknown_rad = std::min(1.5, guide::rotation_deviation_rad(hand_eye));
      turn += step.head<3>().norm() * unknown_rad;
      shift += step.tail<3>().norm() * unknown_rad + step.head<3>().norm() * guide::shift_deviation_mm(hand_eye);
    }
    pose.covariance = (Vector6d() << Eigen::Vector3d::Constant(turn * turn), Eigen::Vector3d::Constant(shift * shift))
                          .finished()
                          .asDiagonal();
    pose.convergence.clear();
  });
}

/// The motion that the robot is told, and the motion that the images should show.
struct Command {
  Vector6d step = Vector6d::Zero();
  RigidTransform told{"robot", "robot"}, expected{"reference", "reference"};
  Matrix6d hand_eye = Matrix6d::Zero();  ///< covariance of the robot's place
};

/// Shortens a step: the uncertainty of the robot's place must not lead the fracture farther astray than the bones are
/// apart, or than `astray_mm` if this is more.
Vector6d careful(const Vector6d& step, const Matrix6d& hand_eye, double distance_mm, double astray_mm) {
  constexpr double kArm_mm = 150;  // from the fragment's middle to the fracture
  const double turn = step.head<3>().norm(), unknown_rad = std::min(1.5, guide::rotation_deviation_rad(hand_eye)),
               unknown_mm = std::min(60.0, guide::shift_deviation_mm(hand_eye)),
               astray = unknown_rad * (step.tail<3>().norm() + kArm_mm * turn) + unknown_mm * turn;
  return step * std::min(1.0, std::max(distance_mm, astray_mm) / std::max(astray, 1e-9));
}

Command command_for(const GuideState& state, const RobotReport& report, const Leg& leg,
                    const Eigen::Vector3d& middle_mm, double distance_mm, const Options& options) {
  Command command;
  const robot::HandEye hand_eye = robot::estimate_hand_eye(
      options.hand_eye == "estimated" ? state.moves : std::vector<robot::Move>(), state.guess, options);
  command.hand_eye = hand_eye.covariance;
  command.step = guide::limited_step(leg.error, options);
  if (options.hand_eye == "estimated")
    command.step = careful(command.step, hand_eye.covariance, distance_mm, options.astray_mm);
  command.expected = guide::motion_of(command.step, middle_mm);
  Vector6d ask = command.step;
  if (options.hand_eye == "broyden") {
    ask = guide::from_mm(guide::ask_for(state.jacobian, guide::in_mm(command.step)));
    ask = guide::limited_step(-ask, {1, options.max_rotation_deg, options.max_shift_mm});
  }
  command.told = guide::told_for(guide::motion_of(ask, middle_mm), hand_eye.robot_from_reference);
  constexpr double kUnknown_deg = 45;  // of the robot's direction: a step may lead anywhere
  const bool is_lost = degrees(guide::rotation_deviation_rad(hand_eye.covariance)) > kUnknown_deg;
  if (options.hand_eye == "estimated" && is_lost && report.is_pressed) {
    // Going back releases bones that were pressed together on the way here.
    command.told = inverse(state.told);
    command.expected = inverse(hand_eye.robot_from_reference) * command.told * hand_eye.robot_from_reference;
    command.step = guide::step_of(command.expected, middle_mm);
  }
  return command;
}

Result closed_loop(const List<Pose>& poses, const GuideState& before, const RobotReport& report,
                   const List<SignedField>& fields, const List<Mesh>& models, const List<Verdict>* verdicts,
                   const List<View>* views, const Options& options, Context& context) {
  const auto [moved, reference] = geometry::poses_of_pair(poses, options, &models);
  const auto bone = [&](const std::string& fragment) -> guide::Gap::Bone {
    return {geometry::of_fragment(models, fragment, "surface"), geometry::of_fragment(fields, fragment, "field")};
  };
  const guide::Gap gap(bone(options.moved), bone(options.reference));
  const RelativePose relative = guide::relative_pose(moved, reference);
  const RigidTransform& seen = relative.reference_from_fragment;
  const Eigen::Vector3d centre_mm = moved.frame.origin_mm, middle_mm = seen * centre_mm;
  Result result;
  GuideState& state = result.state = before;
  ++state.pairs;
  state.images += views ? int(views->size()) : 2;
  if (state.pairs == 1) {
    RigidTransform world_from_reference = reference.world_from_model;
    world_from_reference.source = "reference";
    state.guess = report.robot_from_world * world_from_reference;
  }
  learn(state, seen, centre_mm, report);
  const Remaining remaining(relative, centre_mm);
  // The sum, because the shift does not become smaller while the fragment is held apart and rotated.
  state.errors.push_back(remaining.rotation_deg / options.reduced_deg + remaining.shift_mm / options.reduced_mm);
  std::string not_trusted = why_not_trusted(moved, options.moved, verdicts);
  if (not_trusted.empty()) not_trusted = why_not_trusted(reference, options.reference, verdicts);
  result.stop = stop_of(state, remaining, not_trusted, report, options);
  Command command;
  if (!result.stop.stops) {
    constexpr double kBack_mm = 4;  // after bones have touched
    const Leg leg = report.is_pressed ? guide::leg_apart(moved.frame, reference.frame, kBack_mm)
                                      : guide::next_leg(gap, seen, moved.frame, reference.frame, options);
    command = command_for(state, report, leg, middle_mm, gap.distance_mm(seen), options);
    state.told = command.told;
    result.stop.reason = leg.stage + ": " + result.stop.reason;
  }
  result.motion.world_from_model = command.told;
  result.predicted = predicted(poses, models, command.expected, command.step, command.hand_eye, options);
  context.info(formatted("pair {}: {}", state.pairs, result.stop.reason));
  result.metrics.items = {
      {"pairs", double(state.pairs), ""},
      {"images", double(state.images), ""},
      {"rotation_deg", remaining.rotation_deg, "deg"},
      {"shift_mm", remaining.shift_mm, "mm"},
      {"deviation_deg", remaining.deviation_deg, "deg"},
      {"deviation_mm", remaining.deviation_mm, "mm"},
      {"distance_mm", gap.distance_mm(seen), "mm"},
      {"step_deg", degrees(command.step.head<3>().norm()), "deg"},
      {"step_mm", command.step.tail<3>().norm(), "mm"},
      {"robot_known_to_deg", degrees(guide::rotation_deviation_rad(command.hand_eye)), "deg"},
      {"reduced", double(result.stop.stops && result.stop.reason.starts_with("the fracture is reduced")), ""}};
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("guide.closed_loop", closed_loop)
      .summary(
          "Brings a fragment to its place step by step: each pair of images gives the next motion of a robot whose "
          "place is not known")
      .in("poses", "poses of both fragments in the newest images, with their covariances", over("fragment"))
      .in("state", "what is known from the earlier pairs")
      .in("report", "what the robot says of its last motion")
      .in("fields", "both fragments in the CT, to keep them apart", over("fragment"))
      .in("models", "surfaces of both fragments; they give the axes of poses that have none", over("fragment"))
      .in("verdicts", "verdicts on the poses; a wrong one ends the loop", over("fragment"))
      .in("views", "the newest images, to count them; none: two in each pair", over("view"))
      .out("state", &Result::state, "what is known after this pair")
      .out("motion", &Result::motion, "next motion in the axes of the robot's base; none at the end")
      .out("stop", &Result::stop, "whether the loop ends, and why; else the stage and what remains")
      .out("predicted", &Result::predicted, "poses that are expected in the next images", over("fragment"))
      .out("metrics", &Result::metrics,
           "pairs and images so far, what remains and how exactly it is known, distance between the bones, next step")
      .figures({"pairs", "images", "rotation_deg", "shift_mm", "deviation_deg", "deviation_mm", "distance_mm",
                "step_deg", "step_mm", "robot_known_to_deg", "reduced"})
      .option("moved", &Options::moved, "fragment that the robot holds")
      .option("reference", &Options::reference, "fragment that stays")
      .option("hand_eye", &Options::hand_eye,
              "the robot's place: estimated from its moves, fixed as planned, or replaced by Broyden's Jacobian",
              one_of({"estimated", "fixed", "broyden"}))
      .option("damping", &Options::damping, "part of the way that a step takes (lambda)", at_least(0.01), at_most(1),
              unit(""))
      .option("max_rotation_deg", &Options::max_rotation_deg, "largest rotation of a step", at_least(0.01))
      .option("max_shift_mm", &Options::max_shift_mm, "largest shift of a step", at_least(0.01))
      .option("astray_mm", &Options::astray_mm,
              "with 'estimated': steps are shortened until the uncertainty of the robot's place leads them at most "
              "this far astray, or as far as the bones are apart",
              at_least(0.1))
      .option("clearance_mm", &Options::clearance_mm, "the bones are kept this far apart on the way")
      .option("max_distraction_mm", &Options::max_distraction_mm, "how far they may be pulled apart for this",
              at_least(0))
      .option("rotated_deg", &Options::rotated_deg, "a smaller rotation does not count as a stage", at_least(0))
      .option("aligned_mm", &Options::aligned_mm, "the same for a shift across the shaft", at_least(0))
      .option("motion_deviation_deg", &Options::motion_deviation_deg, "deviation of a seen motion's rotation",
              at_least(1e-6))
      .option("motion_deviation_mm", &Options::motion_deviation_mm, "deviation of its shift", at_least(1e-6))
      .option("motion_deviation_fraction", &Options::motion_deviation_fraction,
              "deviation that is added, as a fraction of the motion", at_least(0), unit(""))
      .option("guess_deg", &Options::guess_deg, "deviation of the robot's planned direction", at_least(1e-3))
      .option("guess_mm", &Options::guess_mm, "deviation of its planned place", at_least(1e-3))
      .option("reduced_deg", &Options::reduced_deg,
              "the fracture is reduced if the rotation plus two deviations is below this", at_least(1e-3))
      .option("reduced_mm", &Options::reduced_mm, "and the shift plus two deviations below this", at_least(1e-3))
      .option("max_deviation_deg", &Options::max_deviation_deg, "poses with a larger deviation are not trusted",
              at_least(0))
      .option("max_deviation_mm", &Options::max_deviation_mm, "the same for the shift", at_least(0))
      .option("max_pairs", &Options::max_pairs, "largest number of pairs of images", at_least(1));
}
