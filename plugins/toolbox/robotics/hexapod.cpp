// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robotics/hexapod.hpp"

#include <Eigen/LU>

#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::robot {
namespace {

std::string in_words(double value, const char* unit) { return formatted("{:.1f} {}", value, unit); }

Eigen::Vector3d leg_mm(const Hexapod& hexapod, const RigidTransform& base_from_platform, std::size_t i) {
  return base_from_platform * hexapod.platform_mm[i] - hexapod.base_mm[i];
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Derivatives of the lengths by a small rotation about the platform's origin and a shift, both in the base's axes.
Matrix6d slopes_of(const Hexapod& hexapod, const RigidTransform& base_from_platform) {
  Matrix6d slopes;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d along = leg_mm(hexapod, base_from_platform, i).normalized();
    const Eigen::Vector3d arm = base_from_platform.rotation * hexapod.platform_mm[i];
    slopes.row(Eigen::Index(i)) << arm.cross(along).transpose(), along.transpose();
  }
  return slopes;
}

/// The same, with a rotation in mm of the platform's joints.
Matrix6d slopes_per_mm(const Hexapod& hexapod, const RigidTransform& base_from_platform) {
  double squares = 0;
  for (const Eigen::Vector3d& joint : hexapod.platform_mm) squares += joint.squaredNorm() / 6;
  Matrix6d slopes = slopes_of(hexapod, base_from_platform);
  slopes.leftCols<3>() /= std::sqrt(squares);
  return slopes;
}

std::string condition_in_words(double value) {
  return std::isfinite(value) ? formatted("the condition of its legs is {:.0f}", value) : "the pose is singular";
}

/// Throws Error unless the legs hold the platform, also on the way from home. The message begins with `begin`.
void check_held(const Hexapod& hexapod, const RigidTransform& base_from_platform, const std::string& begin) {
  const double value = condition(hexapod, base_from_platform);
  if (!(value <= kMostCondition))
    throw Error(
        formatted("{}the hexapod's legs do not hold the platform in this pose: {}, at most {:.0f} is allowed; give "
                  "another motion, or another shape of the hexapod",
                  begin, condition_in_words(value), kMostCondition));
  // The determinant changes its sign at a singular pose.
  if (slopes_per_mm(hexapod, base_from_platform).determinant() *
          slopes_per_mm(hexapod, hexapod.base_from_home).determinant() <
      0)
    throw Error(begin +
                "the hexapod cannot come from home to this pose: on the way its legs pass a singular pose, where "
                "they do not hold the platform; give a smaller motion");
}

}  // namespace

Hexapod make_hexapod(const HexapodShape& shape) {
  const auto on_circle = [](double radius_mm, double angle_deg) {
    return Eigen::Vector3d(radius_mm * std::cos(radians(angle_deg)), radius_mm * std::sin(radians(angle_deg)), 0);
  };
  Hexapod hexapod;
  hexapod.base_from_home.translation_mm.z() = shape.height_mm;
  for (int i = 0; i < 6; ++i) {
    // Legs 0 and 1 begin at the pair at 0 degrees and end at the pairs at -60 and 60 degrees.
    const int pair = i / 2, side = i % 2 == 0 ? -1 : 1;
    hexapod.base_mm[std::size_t(i)] = on_circle(shape.base_radius_mm, 120 * pair + side * 0.5 * shape.base_gap_deg);
    hexapod.platform_mm[std::size_t(i)] =
        on_circle(shape.platform_radius_mm, 120 * pair + side * (60 - 0.5 * shape.platform_gap_deg));
  }
  return hexapod;
}

Hexapod as_built(Hexapod hexapod, double joint_sd_mm, int seed) {
  Random random{std::uint64_t(seed)};
  for (auto* joints : {&hexapod.base_mm, &hexapod.platform_mm})
    for (Eigen::Vector3d& joint : *joints) {
      const double x = random.normal(), y = random.normal(), z = random.normal();
      joint += joint_sd_mm * Eigen::Vector3d(x, y, z);
    }
  return hexapod;
}

Vector6d leg_lengths_mm(const Hexapod& hexapod, const RigidTransform& base_from_platform) {
  Vector6d lengths;
  for (std::size_t i = 0; i < 6; ++i) lengths[Eigen::Index(i)] = leg_mm(hexapod, base_from_platform, i).norm();
  return lengths;
}

Vector6d joint_angles_rad(const Hexapod& hexapod, const RigidTransform& base_from_platform) {
  Vector6d angles;
  for (std::size_t i = 0; i < 6; ++i) {
    const Eigen::Vector3d now = leg_mm(hexapod, base_from_platform, i),
                          home = leg_mm(hexapod, hexapod.base_from_home, i);
    angles[Eigen::Index(i)] =
        std::max(angle_between(now, home), angle_between(base_from_platform.rotation.transpose() * now,
                                                         hexapod.base_from_home.rotation.transpose() * home));
  }
  return angles;
}

double condition(const Hexapod& hexapod, const RigidTransform& base_from_platform) {
  constexpr double kSingular = 1e-14;  // of the largest square, within which a square cannot be told from 0
  const Matrix6d slopes = slopes_per_mm(hexapod, base_from_platform);
  if (!slopes.allFinite()) return std::numeric_limits<double>::infinity();
  const Vector6d squares = eigen_of_symmetric<6>(slopes.transpose() * slopes).values;
  return squares[0] > kSingular * squares[5] ? std::sqrt(squares[5] / squares[0])
                                             : std::numeric_limits<double>::infinity();
}

std::string doubtful_condition(double worst, const std::string& what) {
  if (!(worst > kDoubtfulCondition)) return "";
  return what + formatted(
                    " comes near a singular pose of the hexapod: the condition of its legs is {:.0f}, and above "
                    "{:.0f} an error of a leg moves the platform several times as far as usual",
                    worst, kDoubtfulCondition);
}

void check_workspace(const Hexapod& hexapod, const HexapodLimits& limits, const RigidTransform& base_from_platform,
                     const std::string& what) {
  const Vector6d lengths = leg_lengths_mm(hexapod, base_from_platform),
                 middle = leg_lengths_mm(hexapod, hexapod.base_from_home),
                 angles = joint_angles_rad(hexapod, base_from_platform);
  for (Eigen::Index i = 0; i < 6; ++i) {
    const std::string begin = formatted("{} is outside the hexapod's workspace: leg {}", what, i + 1);
    if (std::abs(lengths[i] - middle[i]) > limits.stroke_mm)
      throw Error(begin + " would be " + in_words(lengths[i], "mm") + " long, its limits are " +
                  in_words(middle[i] - limits.stroke_mm, "mm") + " and " +
                  in_words(middle[i] + limits.stroke_mm, "mm") + "; give a smaller motion");
    if (degrees(angles[i]) > limits.joint_deg)
      throw Error(begin + " would turn by " + in_words(degrees(angles[i]), "degrees") + " in its joint, its limit is " +
                  in_words(limits.joint_deg, "degrees") + "; give a smaller motion");
  }
  check_held(hexapod, base_from_platform, what + ": ");
}

PlatformPose pose_of_legs(const Hexapod& hexapod, const Vector6d& lengths_mm, const RigidTransform& start) {
  constexpr int kMostSteps = 30;
  constexpr double kExact_mm = 1e-9, kLargestTurn_rad = 0.5;
  check_rigid(start, "the pose to start from");
  check_held(hexapod, start, "");
  PlatformPose found{start, 0};
  for (;; ++found.steps) {
    const Vector6d missing = lengths_mm - leg_lengths_mm(hexapod, found.base_from_platform);
    if (!missing.allFinite()) throw Error("the lengths of the hexapod's legs are not all numbers");
    if (missing.cwiseAbs().maxCoeff() < kExact_mm) {
      check_held(hexapod, found.base_from_platform, "");
      return found;
    }
    const Eigen::FullPivLU<Matrix6d> slopes(slopes_of(hexapod, found.base_from_platform));
    if (found.steps == kMostSteps || !slopes.isInvertible())
      throw Error(
          formatted("no pose of the platform near the start has these lengths of the legs: after {} steps a leg still "
                    "differs by {}",
                    found.steps, in_words(missing.cwiseAbs().maxCoeff(), "mm")));
    Vector6d step = slopes.solve(missing);
    if (const double turn = step.head<3>().norm(); turn > kLargestTurn_rad) step *= kLargestTurn_rad / turn;
    found.base_from_platform.rotation = rotation_from_vector(step.head<3>()) * found.base_from_platform.rotation;
    found.base_from_platform.translation_mm += step.tail<3>();
  }
}

}  // namespace marrow::robot
