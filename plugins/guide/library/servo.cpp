// SPDX-License-Identifier: Apache-2.0
#include "marrow/guide/servo.hpp"

#include <cmath>

#include "marrow/domain/decompositions.hpp"

namespace marrow::guide {
namespace {

constexpr double kArm_mm = 100;

FragmentFrame frame_at(const Eigen::Vector3d& centre_mm) {
  FragmentFrame frame;
  frame.origin_mm = centre_mm;
  frame.axes.setIdentity();
  return frame;
}

}  // namespace

Vector6d limited_step(const Vector6d& error, const StepLimits& limits) {
  const Vector6d step = -limits.damping * error;
  const double share = std::max(
      {1.0, degrees(step.head<3>().norm()) / limits.max_rotation_deg, step.tail<3>().norm() / limits.max_shift_mm});
  return step / share;
}

RigidTransform motion_of(const Vector6d& step, const Eigen::Vector3d& centre_mm) {
  return moved({"reference", "reference"}, frame_at(centre_mm), step);
}

Vector6d step_of(const RigidTransform& motion, const Eigen::Vector3d& centre_mm) {
  return motion_between({motion.target, motion.source}, motion, frame_at(centre_mm));
}

RigidTransform told_for(const RigidTransform& seen, const RigidTransform& robot_from_reference) {
  return robot_from_reference * seen * inverse(robot_from_reference);
}

Vector6d in_mm(const Vector6d& motion) {
  Vector6d result = motion;
  result.head<3>() *= kArm_mm;
  return result;
}

Vector6d from_mm(const Vector6d& motion_mm) {
  Vector6d result = motion_mm;
  result.head<3>() /= kArm_mm;
  return result;
}

Matrix6d broyden(const Matrix6d& jacobian, const Vector6d& asked_mm, const Vector6d& seen_mm) {
  constexpr double kLeast_mm = 0.5;
  if (asked_mm.norm() < kLeast_mm) return jacobian;
  return jacobian + (seen_mm - jacobian * asked_mm) * asked_mm.transpose() / asked_mm.squaredNorm();
}

Vector6d ask_for(const Matrix6d& jacobian, const Vector6d& wanted_mm, double mu) {
  const Matrix6d squares = jacobian.transpose() * jacobian + mu * mu * Matrix6d::Identity();
  return solve_symmetric<6>(squares, Vector6d(jacobian.transpose() * wanted_mm));
}

namespace {

double largest(const Eigen::Matrix3d& covariance) {
  return covariance.allFinite() ? std::sqrt(std::max(0.0, eigen_of_symmetric<3>(covariance).values[2]))
                                : std::numeric_limits<double>::infinity();
}

}  // namespace

RelativePose relative_pose(const Pose& fragment, const Pose& reference) {
  check_pose(fragment, "the pose of the fragment");
  check_pose(reference, "the pose of the reference");
  RelativePose relative;
  relative.reference_from_fragment = inverse(reference.world_from_model) * fragment.world_from_model;
  relative.reference_from_fragment.target = "reference";
  relative.reference_from_fragment.source = "fragment";
  relative.covariance.setConstant(std::numeric_limits<double>::quiet_NaN());
  if (!fragment.covariance || !reference.covariance) return relative;
  const RigidTransform& place = relative.reference_from_fragment;
  const FragmentFrame middle{place * fragment.frame.origin_mm, Eigen::Matrix3d::Identity()};
  const FragmentFrame own{middle.origin_mm, place.rotation * fragment.frame.axes};
  const Matrix6d of_fragment = change_of_frame(own, middle), of_reference = change_of_frame(reference.frame, middle);
  relative.covariance = of_fragment * *fragment.covariance * of_fragment.transpose() +
                        of_reference * *reference.covariance * of_reference.transpose();
  return relative;
}

double rotation_deviation_rad(const Matrix6d& covariance) { return largest(covariance.topLeftCorner<3, 3>()); }
double shift_deviation_mm(const Matrix6d& covariance) { return largest(covariance.bottomRightCorner<3, 3>()); }

namespace {

double field_at(const SignedField& field, const Eigen::Vector3d& point_mm) {
  return sample_trilinear(field.grid, field.values_mm, field.grid.index_from_point(point_mm));
}

/// Points of one surface within reach of the fracture: where it is near the other surface in the CT.
std::vector<Eigen::Vector3d> points_of(const Mesh& mesh, const SignedField& other) {
  constexpr double kReach_mm = 60, kFacing_mm = 3;
  constexpr std::size_t kSamples = 8000;
  const std::vector<Eigen::Vector3d> all = sample_surface(mesh, kSamples);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double facing = 0;
  for (const Eigen::Vector3d& point : all)
    if (field_at(other, point) < kFacing_mm) middle += point, ++facing;
  std::vector<Eigen::Vector3d> points;
  for (const Eigen::Vector3d& point : all)
    if (facing > 0 && (point - middle / facing).norm() < kReach_mm) points.push_back(point);
  return points;
}

/// The place on the straight way from `from` to `to` after a share of it.
RigidTransform between(const RigidTransform& from, const RigidTransform& to, const Eigen::Vector3d& centre_mm,
                       double share) {
  RigidTransform at = from;
  at.rotation =
      rotation_from_vector(share * vector_from_rotation(to.rotation * from.rotation.transpose())) * from.rotation;
  at.translation_mm = (1 - share) * (from * centre_mm) + share * (to * centre_mm) - at.rotation * centre_mm;
  return at;
}

class Approach {
 public:
  Approach(const Gap& gap, const RigidTransform& now, const FragmentFrame& frame, double clearance_mm)
      : gap_(gap), frame_(frame), clearance_mm_(clearance_mm) {
    // In the restored bone, the fragments of a CT touch.
    constexpr double kTolerance_mm = 1;
    in_place_mm_ = gap.distance_mm({now.target, now.source}) - kTolerance_mm;
  }

  bool is_free(const RigidTransform& from, const RigidTransform& to) const {
    const Eigen::Vector3d way = to * frame_.origin_mm - from * frame_.origin_mm;
    const double turn = degrees(geodesic_angle_rad(to.rotation, from.rotation));
    const int parts = std::clamp(int(std::ceil(std::max(way.norm(), turn))), 1, 40);
    // Fragments that are too near at the beginning must not come nearer.
    const double at_first = gap_.distance_mm(from) - 0.5;
    for (int i = 1; i <= parts; ++i) {
      const RigidTransform at = between(from, to, frame_.origin_mm, double(i) / parts);
      if (gap_.distance_mm(at) < std::min(least_at(at), at_first)) return false;
    }
    return true;
  }

 private:
  /// How far apart the bones are kept at a place: less near the place in the restored bone.
  double least_at(const RigidTransform& at) const {
    constexpr double kPart = 0.3, kArm_mm = 100;
    const double way =
        (at * frame_.origin_mm - frame_.origin_mm).norm() + kArm_mm * vector_from_rotation(at.rotation).norm();
    return std::min(clearance_mm_, in_place_mm_ + kPart * way);
  }

  const Gap& gap_;
  const FragmentFrame& frame_;
  const double clearance_mm_;
  double in_place_mm_;
};

RigidTransform shifted(RigidTransform place, const Eigen::Vector3d& by_mm) {
  place.translation_mm += by_mm;
  return place;
}

/// Along the shaft of the reference, away from it.
Eigen::Vector3d away_from(const FragmentFrame& reference, const FragmentFrame& frame) {
  const Eigen::Vector3d shaft = reference.axes.col(2);
  return shaft.dot(frame.origin_mm - reference.origin_mm) > 0 ? shaft : Eigen::Vector3d(-shaft);
}

}  // namespace

Gap::Gap(const Bone& moved, const Bone& reference)
    : of_moved_(moved.field),
      of_reference_(reference.field),
      on_moved_(points_of(moved.surface, reference.field)),
      on_reference_(points_of(reference.surface, moved.field)) {
  check_lies_in(moved.surface, moved.field.grid, "the moved fragment's surface", "its field");
  check_lies_in(reference.surface, reference.field.grid, "the reference's surface", "its field");
  if (on_moved_.empty() || on_reference_.empty())
    throw Error("the two fragments are nowhere within 3 mm of each other in the CT; are they sides of one fracture?");
}

double Gap::distance_mm(const RigidTransform& reference_from_fragment) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& point : on_moved_)
    least = std::min(least, field_at(of_reference_, reference_from_fragment * point));
  const RigidTransform back = inverse(reference_from_fragment);
  for (const Eigen::Vector3d& point : on_reference_) least = std::min(least, field_at(of_moved_, back * point));
  return least;
}

Leg leg_apart(const FragmentFrame& frame, const FragmentFrame& reference, double by_mm) {
  Leg leg{Vector6d::Zero(), "distract"};
  leg.error.tail<3>() = -by_mm * away_from(reference, frame);
  return leg;
}

Leg next_leg(const Gap& gap, const RigidTransform& now, const FragmentFrame& frame, const FragmentFrame& reference,
             const ApproachOptions& options) {
  constexpr double kStep_mm = 2;
  const Approach approach(gap, now, frame, options.clearance_mm);
  const RigidTransform place{now.target, now.source};
  const Eigen::Vector3d shaft = reference.axes.col(2), apart = away_from(reference, frame);
  const auto leg_to = [&](const RigidTransform& to) {
    Leg leg;
    leg.error << vector_from_rotation(now.rotation * to.rotation.transpose()),
        now * frame.origin_mm - to * frame.origin_mm;
    return leg;
  };
  Leg leg = leg_to(place);
  const double across_mm = (leg.error.tail<3>() - shaft * shaft.dot(leg.error.tail<3>())).norm();
  const std::string next = degrees(leg.error.head<3>().norm()) > options.rotated_deg ? "rotate"
                           : across_mm > options.aligned_mm                          ? "align"
                                                                                     : "release";
  leg.stage = next;
  if (approach.is_free(now, place)) return leg;
  for (double away = kStep_mm; away <= options.max_distraction_mm; away += kStep_mm) {
    const RigidTransform by = shifted(place, away * apart);
    if (!approach.is_free(by, place) || !approach.is_free(now, by)) continue;
    leg = leg_to(by);
    leg.stage = next == "release" ? "align" : next;
    return leg;
  }
  // First pull the fragment away from where it is, until a way is free from there.
  const double room_mm =
      options.max_distraction_mm - apart.dot(Eigen::Vector3d(now * frame.origin_mm - frame.origin_mm));
  for (double away = kStep_mm; away <= room_mm; away += kStep_mm) {
    const RigidTransform here = shifted(now, away * apart);
    for (double beside = kStep_mm; beside <= options.max_distraction_mm; beside += kStep_mm) {
      if (approach.is_free(here, shifted(place, beside * apart))) return leg_apart(frame, reference, away);
    }
  }
  // No way is free by this margin. The fragment is turned where it is farthest apart; the robot feels if bones touch.
  if (room_mm >= kStep_mm) return leg_apart(frame, reference, room_mm);
  leg = leg_to(shifted(place, options.max_distraction_mm * apart));
  leg.stage = next;
  return leg;
}

}  // namespace marrow::guide
