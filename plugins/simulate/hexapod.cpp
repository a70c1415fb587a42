// SPDX-License-Identifier: Apache-2.0
// A bone fragment on a hexapod (Stewart platform) that is told to move. Where the fragment really is depends on errors
// of the legs, of the joints and of the mounting.

#include "marrow/toolbox/robotics/hexapod.hpp"
#include "marrow/simulate/vectors.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::Fragment;
using robot::Hexapod;

struct Options : robot::HexapodShape, robot::HexapodLimits {
  std::string fragment = "distal";
  double grip_mm = 5;
  Eigen::Vector3d fragment_at_mm{3, -4, 5};
  Eigen::Vector3d stand_deg{2, -3, 25};
  double leg_sd_mm = 0.02;
  double joint_sd_mm = 0.05;
  double mount_sd_deg = 2, mount_sd_mm = 2;
  int platform_seed = 1;
};

struct Result {
  List<Truth> platform, fragment;
  Pose start;
  List<Metrics> legs;
};

/// The fragment stands on the platform with its fracture downwards, its long axis along z. `grip_mm`: height of its
/// lowest point.
RigidTransform platform_from_ct(const Fragment& fragment, double grip_mm) {
  if (fragment.outer.triangles.empty())
    throw Error("simulate.hexapod: fragment '" + fragment.name +
                "' has no surface of its own; make it with simulate.fracture");
  Eigen::Matrix3d upright = Eigen::Matrix3d::Identity();
  if (fragment.side < 0) upright.diagonal() << 1, -1, -1;
  RigidTransform transform{"platform", "ct", upright * fragment.frame.axes.transpose(), Eigen::Vector3d::Zero()};
  transform.translation_mm = -transform.rotation * fragment.frame.origin_mm;
  double lowest = 0;
  for (const auto& triangle : fragment.outer.triangles)
    for (const std::uint32_t corner : triangle)
      lowest = std::min(lowest, (transform * fragment.outer.vertices_mm[corner]).z());
  transform.translation_mm.z() += grip_mm - lowest;
  return transform;
}

/// The platform stands so that the fragment's middle lies at `fragment_at_mm` while the platform is at home.
RigidTransform world_from_base(const Hexapod& hexapod, const RigidTransform& platform_from_ct, const Fragment& fragment,
                               const Options& options) {
  RigidTransform transform{"world", "base", rotation_from_vector(options.stand_deg * kPi / 180),
                           Eigen::Vector3d::Zero()};
  const RigidTransform base_from_ct = hexapod.base_from_home * platform_from_ct;
  transform.translation_mm = options.fragment_at_mm - transform.rotation * (base_from_ct * fragment.frame.origin_mm);
  return transform;
}

/// The mounting's error: a turn about the fragment's middle and a shift.
RigidTransform misplaced(const RigidTransform& platform_from_ct, const Eigen::Vector3d& middle_mm,
                         const Options& options, std::uint64_t seed) {
  marrow::Random random(seed, 0);
  const Eigen::Vector3d middle = platform_from_ct * middle_mm;
  RigidTransform error{"platform", "platform",
                       rotation_from_vector(radians(options.mount_sd_deg) * phantom::normal_vector(random)),
                       Eigen::Vector3d::Zero()};
  error.translation_mm = middle - error.rotation * middle + options.mount_sd_mm * phantom::normal_vector(random);
  return error * platform_from_ct;
}

Metrics figures_of(const Vector6d& lengths_mm, double condition) {
  Metrics metrics;
  for (int i = 0; i < 6; ++i) metrics.items.push_back({formatted("leg{}", i + 1), lengths_mm[i], "mm"});
  metrics.items.push_back({"condition", condition, ""});
  return metrics;
}

Result hexapod(const phantom::Phantom& phantom, const List<Pose>& commands, const Options& options, Context& context) {
  phantom::check_phantom(phantom, "simulate.hexapod");
  const Fragment& fragment = phantom::fragment_named(phantom, options.fragment, "simulate.hexapod");
  const Hexapod nominal = robot::make_hexapod(options),
                built = robot::as_built(nominal, options.joint_sd_mm, options.platform_seed);
  const RigidTransform upright = platform_from_ct(fragment, options.grip_mm),
                       world = world_from_base(nominal, upright, fragment, options),
                       mounted = misplaced(upright, fragment.frame.origin_mm, options, context.seed());
  robot::check_workspace(nominal, options, nominal.base_from_home, "simulate.hexapod: home");
  double worst = robot::condition(nominal, nominal.base_from_home);
  Result result;
  result.start.world_from_model = world * nominal.base_from_home * upright;
  for (std::size_t i = 0; i < commands.size(); ++i) {
    const std::string& name = commands.name(i);
    check_rigid(commands[i].world_from_model, "motion '" + name + "'");
    RigidTransform motion = commands[i].world_from_model;
    motion.target = motion.source = "platform";
    const RigidTransform told = nominal.base_from_home * motion;
    robot::check_workspace(nominal, options, told, "simulate.hexapod: motion '" + name + "'");
    Vector6d lengths = robot::leg_lengths_mm(nominal, told);
    const double condition = robot::condition(nominal, told);
    worst = std::max(worst, condition);
    result.legs.add(name, figures_of(lengths, condition));
    marrow::Random random(context.seed(), i + 1);
    for (int k = 0; k < 6; ++k) lengths[k] += options.leg_sd_mm * random.normal();
    const RigidTransform platform = world * robot::pose_of_legs(built, lengths, told).base_from_platform;
    result.platform.add(name, Truth{platform});
    result.fragment.add(name, Truth{platform * mounted});
  }
  if (const std::string text = robot::doubtful_condition(worst, "a motion"); !text.empty()) context.warn(text);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  auto node = plugin.node("simulate.hexapod", hexapod);
  node.summary("A bone fragment on a hexapod that is told to move, with errors of its legs, joints and mounting")
      .random()
      .in("phantom", "the fragment; it stands on the platform with its fracture downwards")
      .in("commands", "motions of the platform from home, in the axes of the platform at home, z upwards",
          over("position"))
      .out("platform", &Result::platform, "exact pose of the platform in the world", over("position"))
      .out("fragment", &Result::fragment, "exact pose of the fragment: world from CT", over("position"))
      .out("start", &Result::start, "where the fragment would be with the platform at home, if nothing were off")
      .out("legs", &Result::legs,
           "length of each leg as the controller sets it, and the condition of the legs: how many times as far an "
           "error of them moves the platform in the worst direction as in the best one",
           over("position"))
      .figures({"leg1", "leg2", "leg3", "leg4", "leg5", "leg6", "condition"})
      .option("fragment", &Options::fragment, "name of the fragment on the platform");
  robot::declare_hexapod<Options>(node)
      .option("grip_mm", &Options::grip_mm, "height of the fragment's end above the platform's joints", at_least(0))
      .option("fragment_at_mm", &Options::fragment_at_mm,
              "where the fragment's middle lies in the world while the platform is at home, if nothing is off")
      .option("stand_deg", &Options::stand_deg, "rotation vector of the hexapod's base in the world")
      .option("leg_sd_mm", &Options::leg_sd_mm, "standard deviation of each leg's length, drawn for each motion",
              at_least(0))
      .option("joint_sd_mm", &Options::joint_sd_mm,
              "standard deviation of each coordinate of each joint, drawn once for the hexapod", at_least(0))
      .option("mount_sd_deg", &Options::mount_sd_deg,
              "standard deviation of the fragment's turn on the platform about each axis, drawn once in a run",
              at_least(0))
      .option("mount_sd_mm", &Options::mount_sd_mm, "the same for its shift along each axis", at_least(0))
      .option("platform_seed", &Options::platform_seed, "seed of the joints' errors: one hexapod for each seed",
              at_least(0));
}
