// SPDX-License-Identifier: Apache-2.0
#pragma once
// Kinematics of a hexapod (Stewart platform): six legs between joints of a base and joints of a platform.
#include <array>
#include <marrow/plugin.hpp>
#include <string>

namespace marrow::robot {

/// Measures of a regular hexapod. The joints lie in pairs on two circles; the platform's pairs lie between the base's.
struct HexapodShape {
  double base_radius_mm = 150, platform_radius_mm = 90;
  double base_gap_deg = 24, platform_gap_deg = 24;  ///< angle between the two joints of a pair
  double height_mm = 220;                           ///< of the platform's joints above the base's at home

  using fields = Fields<&HexapodShape::base_radius_mm, &HexapodShape::platform_radius_mm, &HexapodShape::base_gap_deg,
                        &HexapodShape::platform_gap_deg, &HexapodShape::height_mm>;
};

/// A hexapod as it is built. All legs have their middle length when the platform is at home.
struct Hexapod {
  std::array<Eigen::Vector3d, 6> base_mm;      ///< joints in the frame "base"
  std::array<Eigen::Vector3d, 6> platform_mm;  ///< joints of the same legs in the frame "platform"
  RigidTransform base_from_home{"base", "platform"};
};

/// The frames lie in the middle of the joints' circles, with z upwards. The base's pairs lie at 0, 120 and 240 degrees
/// from x, the platform's at 60, 180 and 300 degrees.
Hexapod make_hexapod(const HexapodShape& shape);

/// The hexapod as it is built: each coordinate of each joint is off by this standard deviation, drawn from the seed.
Hexapod as_built(Hexapod hexapod, double joint_sd_mm, int seed);

/// What a leg can do.
struct HexapodLimits {
  double stroke_mm = 60;  ///< how far a leg's length may differ from that at home, to either side
  double joint_deg = 40;  ///< how far a leg may turn in its joints from its direction at home

  using fields = Fields<&HexapodLimits::stroke_mm, &HexapodLimits::joint_deg>;
};

/// Lengths of the legs: |t + R b_i - a_i|, with a_i the joints of the base and b_i those of the platform.
Vector6d leg_lengths_mm(const Hexapod& hexapod, const RigidTransform& base_from_platform);

/// By how much each leg is turned from its direction at home: the larger of the angles in its two joints.
Vector6d joint_angles_rad(const Hexapod& hexapod, const RigidTransform& base_from_platform);

/// How well the legs hold the platform: the condition of the legs' Jacobian, which is how many times as far an error of
/// the legs moves the platform in the worst direction as in the best one. A rotation counts as the motion that it gives
/// to the platform's joints (root mean square distance from the platform's middle). 2 to 7 is usual. It is infinite in
/// a singular pose: there the platform is free to move while the legs keep their lengths.
double condition(const Hexapod& hexapod, const RigidTransform& base_from_platform);

constexpr double kDoubtfulCondition = 20;  ///< above it, an error of the legs counts several times as much as usual
constexpr double kMostCondition = 100;     ///< above it, the legs do not hold the platform

/// A warning of the worst of several poses; empty if its condition is not above kDoubtfulCondition. It begins with
/// `what`.
std::string doubtful_condition(double worst, const std::string& what);

/// Throws Error unless all legs and joints are within the limits and the legs hold the platform: its condition is not
/// above kMostCondition, and it does not lie behind a singular pose, seen from home. The message begins with `what`,
/// and says what a leg would need and what it can do.
void check_workspace(const Hexapod& hexapod, const HexapodLimits& limits, const RigidTransform& base_from_platform,
                     const std::string& what);

/// A pose that belongs to given lengths of the legs.
struct PlatformPose {
  RigidTransform base_from_platform{"base", "platform"};
  int steps = 0;  ///< of Newton's method
};

/// The pose with these lengths that Newton's method finds from `start`. (Up to 40 poses have the same lengths:
/// Dietmaier 1998. The start decides.) The lengths then agree to 1e-9 mm. Throws Error if there is no such pose near
/// the start, or if the legs do not hold the platform there (kMostCondition).
PlatformPose pose_of_legs(const Hexapod& hexapod, const Vector6d& lengths_mm, const RigidTransform& start);

/// For nodes that simulate a hexapod: declares the members of HexapodShape and HexapodLimits, from which `Options` is
/// derived.
template <class Options, class Node>
Node& declare_hexapod(Node& node) {
  return node
      .option("base_radius_mm", &Options::base_radius_mm, "radius of the circle of the base's joints", at_least(1))
      .option("platform_radius_mm", &Options::platform_radius_mm, "the same for the platform", at_least(1))
      .option("base_gap_deg", &Options::base_gap_deg, "angle between the two joints of a pair of the base", at_least(0),
              at_most(119))
      .option("platform_gap_deg", &Options::platform_gap_deg, "the same for the platform", at_least(0), at_most(119))
      .option("height_mm", &Options::height_mm, "height of the platform's joints above the base's at home", at_least(1))
      .option("stroke_mm", &Options::stroke_mm, "how far a leg's length may differ from that at home, to either side",
              at_least(0))
      .option("joint_deg", &Options::joint_deg, "how far a leg may turn in its joints from its direction at home",
              at_least(0), at_most(90));
}

}  // namespace marrow::robot
