// SPDX-License-Identifier: Apache-2.0
// Where a drill has to go to lock a nail, from the nail's pose: the axis of each hole with its deviations, the place of
// the drill guide, and the C-arm's angles at which the hole is seen as a circle.
#include <marrow/plugin.hpp>

#include "marrow/domain/decompositions.hpp"
#include "marrow/toolbox/geometry/implant.hpp"

namespace {

using namespace marrow;
using Eigen::Matrix3d, Eigen::Vector3d;
using geometry::Hole, geometry::Implant, geometry::LockingPlan;

/// The probability that a vector with these variances along two axes is longer. Scaled by its deviations, the vector
/// has a uniform direction and a Rayleigh length. So the probability is the mean over the directions of exp(-length^2 /
/// (2 variance along the direction)). The function is smooth and periodic, so few points give all digits.
double longer_than(double length, double large, double small) {
  constexpr int kDirections = 128;  // of a quarter turn; the others are alike
  double sum = 0;
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 0.5 * kPi * (i + 0.5) / kDirections, cosine = std::cos(angle);
    const double variance = small + (large - small) * cosine * cosine;
    sum += std::exp(-0.5 * length * length / variance);
  }
  return sum / kDirections;
}

/// The length that a vector in a plane does not exceed with this probability (above 0, below 1), if it is normally
/// distributed around zero. `covariance` is that of the plane's vectors in space, so its least eigenvalue is 0. The
/// result is exact for any ratio of the other two: 1.96 deviations along a line, 2.45 in a circle. It is NaN or
/// infinite if a variance is.
double length_quantile(const Matrix3d& covariance, double probability) {
  if (!covariance.allFinite()) return std::sqrt(covariance.trace());
  const Eigen::Vector3d variances = eigen_of_symmetric<3>(covariance).values;
  const double large = variances[2], small = std::max(0.0, variances[1]);
  if (!(large > 0)) return 0;
  double low = 0, high = std::sqrt(-2 * large * std::log(1 - probability));  // as if it were a circle
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (longer_than(middle, large, small) > 1 - probability ? low : high) = middle;
  }
  return high;
}

struct LockingOptions {
  std::string side = "unknown";
  std::vector<double> from;
  double guide_mm = 100;
  double max_angle_deg = 1, max_offset_mm = 0.5;
  double max_cost = 0.35;
  Vector3d isocentre_mm = Vector3d::Zero();
  double source_to_isocentre_mm = 600;
};

struct Result {
  LockingPlan plan;
  Verdict verdict;
};

/// A small motion (r, t) of the pose in its frame turns the axis by r x axis and moves the centre by r x arm + t. Only
/// what lies across the axis counts.
void predict(const Pose& pose, const Hole& hole, LockingPlan::Drill& drill) {
  constexpr double kMost = 0.95;
  drill.deviation_deg = drill.deviation_mm = drill.most_deg = drill.most_mm = std::nan("");
  if (!pose.covariance) return;
  const Vector3d axis = pose.frame.axes.transpose() * hole.axis,
                 arm = pose.frame.axes.transpose() * (hole.centre_mm - pose.frame.origin_mm);
  const Matrix3d across = Matrix3d::Identity() - axis * axis.transpose();
  Eigen::Matrix<double, 3, 6> turn, shift;
  turn << -cross_matrix(axis), Matrix3d::Zero();
  shift << -across * cross_matrix(arm), across;
  const Matrix3d of_turn = turn * *pose.covariance * turn.transpose(),
                 of_shift = shift * *pose.covariance * shift.transpose();
  drill.deviation_deg = degrees(std::sqrt(std::max(0.0, of_turn.trace())));
  drill.deviation_mm = std::sqrt(std::max(0.0, of_shift.trace()));
  drill.most_deg = degrees(length_quantile(of_turn, kMost));
  drill.most_mm = length_quantile(of_shift, kMost);
}

/// The C-arm turned so that the ray through the hole's centre runs along its axis. With the viewing direction w, the
/// source lies at isocentre - distance * w. The ray runs along the axis if centre - source = s * axis, so |w| = 1 gives
/// s. The source may be on either side; the side that needs less turning is taken.
void aim(const LockingOptions& options, LockingPlan::Drill& drill) {
  const double distance = options.source_to_isocentre_mm;
  const Vector3d off = drill.centre_mm - options.isocentre_mm, &axis = drill.direction;
  const double along = axis.dot(off), root = along * along - off.squaredNorm() + distance * distance;
  if (!(off.norm() < distance))
    throw Error(
        formatted("plan.locking: hole '{}' lies {:.2f} mm from the isocentre, but the C-arm's source is only {:.2f} mm "
                  "from it; check isocentre_mm and the pose",
                  drill.hole, off.norm(), distance));
  double least = 1e9;
  for (const double s : {along + std::sqrt(root), along - std::sqrt(root)}) {
    const Vector3d w = (s * axis - off) / distance;
    const double alpha = std::asin(std::clamp(w.z(), -1.0, 1.0)), beta = std::atan2(w.x(), -w.y());
    if (std::abs(alpha) + std::abs(beta) >= least) continue;
    least = std::abs(alpha) + std::abs(beta);
    drill.alpha_deg = degrees(alpha);
    drill.beta_deg = degrees(beta);
  }
}

int views_that_show(const Vector3d& point, const List<View>& views) {
  int count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Vector2d pixel = project(views[i].camera, point);
    count += pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= views[i].camera.width_px - 1 &&
             pixel.y() <= views[i].camera.height_px - 1;
  }
  return count;
}

void doubt(const LockingOptions& options, int seen, LockingPlan::Drill& drill) {
  if (std::isnan(drill.deviation_deg))
    drill.doubts.push_back("the pose of the nail has no predicted deviations, so nothing says how far the hole is off");
  if (!(drill.most_deg <= options.max_angle_deg) && !std::isnan(drill.most_deg))
    drill.doubts.push_back(
        formatted("the direction of the hole is known to {:.2f} degrees only (95 %), and the limit is {:.2f}",
                  drill.most_deg, options.max_angle_deg));
  if (!(drill.most_mm <= options.max_offset_mm) && !std::isnan(drill.most_mm))
    drill.doubts.push_back(formatted("the place of the hole is known to {:.2f} mm only (95 %), and the limit is {:.2f}",
                                     drill.most_mm, options.max_offset_mm));
  if (seen < 2) drill.doubts.push_back(formatted("{} shows the hole", seen == 0 ? "no view" : "only one view"));
}

/// The direction in the world from which the drill comes: from the outer side, a little from the front.
Vector3d drills_come_from(const LockingOptions& options) {
  if (options.from.empty()) {
    if (options.side == "unknown")
      throw Error(
          "plan.locking: nothing says from which side the drill comes; give 'side' (left or right: of the leg), or "
          "'from', such as [1, 0, 0] for the patient's left");
    return {options.side == "left" ? 1.0 : -1.0, -0.5, 0};
  }
  if (options.from.size() != 3)
    throw Error(formatted("plan.locking: from takes one direction, as [1, 0, 0], got {} numbers", options.from.size()));
  const Vector3d from = Vector3d::Map(options.from.data());
  if (!(from.norm() > 0))
    throw Error(
        "plan.locking: from has the length 0; give the direction from which the drill comes, such as [1, 0, 0]");
  return from;
}

LockingPlan::Drill drill_of(const Hole& hole, const Pose& pose, const Vector3d& from, const LockingOptions& options) {
  LockingPlan::Drill drill;
  drill.hole = hole.name;
  drill.diameter_mm = hole.diameter_mm;
  drill.centre_mm = pose.world_from_model * hole.centre_mm;
  drill.direction = pose.world_from_model.rotation * hole.axis;
  if (drill.direction.dot(from) > 0) drill.direction = -drill.direction;
  drill.guide_mm = drill.centre_mm - options.guide_mm * drill.direction;
  predict(pose, hole, drill);
  aim(options, drill);
  return drill;
}

/// What concerns the whole nail. `cost`: at the pose; NaN if it is not known.
std::vector<std::string> doubts_about(const Pose& pose, double cost, const LockingOptions& options) {
  std::vector<std::string> doubts;
  for (const std::string& warning : pose.warnings) doubts.push_back("the registration warns: " + warning);
  if (cost > options.max_cost)
    doubts.push_back(formatted(
        "the images do not show the holes where this pose has them: the cost there is {:.2f}, and the limit is {:.2f}",
        cost, options.max_cost));
  return doubts;
}

Verdict judge(const LockingPlan& plan, const std::vector<std::string>& about_all) {
  Verdict verdict;
  verdict.judgement = Judgement::trusted;
  verdict.reasons = about_all;
  for (const LockingPlan::Drill& drill : plan.drills) {
    for (const std::string& doubt : drill.doubts)
      if (std::find(about_all.begin(), about_all.end(), doubt) == about_all.end())
        verdict.reasons.push_back(drill.hole + ": " + doubt);
    verdict.figures.push_back({drill.hole + "_deviation_deg", drill.deviation_deg, "deg"});
    verdict.figures.push_back({drill.hole + "_deviation_mm", drill.deviation_mm, "mm"});
  }
  if (!verdict.reasons.empty()) {
    verdict.judgement = Judgement::doubtful;
    verdict.remedies = {"a view along the hole, as planned, in which the hole must be a circle",
                        "a look at the overlay of each view"};
    return verdict;
  }
  double most_deg = 0, most_mm = 0;
  for (const LockingPlan::Drill& drill : plan.drills) {
    most_deg = std::max(most_deg, drill.most_deg);
    most_mm = std::max(most_mm, drill.most_mm);
  }
  verdict.reasons = {
      formatted("the axes of the holes are known to {:.2f} degrees and {:.2f} mm (95 %)", most_deg, most_mm)};
  return verdict;
}

Result locking(const Implant& implant, const Pose& pose, const List<View>& views, const Cost* cost,
               const LockingOptions& options) {
  geometry::check_implant(implant, "plan.locking");
  check_pose(pose, "plan.locking: the pose of the nail");
  const Vector3d from = drills_come_from(options);
  Result result;
  result.plan.isocentre_mm = options.isocentre_mm;
  result.plan.source_to_isocentre_mm = options.source_to_isocentre_mm;
  const double at_holes = cost ? cost->value(pose.world_from_model) : std::nan("");
  const std::vector<std::string> about_all = doubts_about(pose, at_holes, options);
  int seen_at_all = 0;
  for (const Hole& hole : implant.holes) {
    LockingPlan::Drill drill = drill_of(hole, pose, from, options);
    const int seen = views_that_show(drill.centre_mm, views);
    seen_at_all += seen;
    drill.doubts = about_all;
    doubt(options, seen, drill);
    result.plan.drills.push_back(std::move(drill));
  }
  if (seen_at_all == 0)
    throw Error(
        formatted("plan.locking: no view shows any of the {} holes of the nail at its pose; take images of the nail's "
                  "tip, or check the pose",
                  implant.holes.size()));
  result.verdict = judge(result.plan, about_all);
  if (cost) result.verdict.figures.push_back({"cost_at_holes", at_holes, ""});
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("plan.locking", locking)
      .summary(
          "Where a drill has to go to lock a nail: the axes of its holes, the drill guides, and the C-arm's angles")
      .in("implant", "the nail with its holes")
      .in("pose", "pose of the nail in the world, with its predicted covariance")
      .in("views", "the views in which the nail was found", over("view"))
      .in("cost", "cost of the nail's pose in the surroundings of its holes (mask.near_holes)")
      .out("plan", &Result::plan,
           "for each hole in world coordinates: centre, direction of the drill, place of the drill guide, predicted "
           "deviations, and the C-arm's angles at which the hole is seen as a circle")
      .out("verdict", &Result::verdict,
           "doubtful if the predicted deviations of a hole's axis are too large, if fewer than two views show a hole, "
           "if the registration warns, or if `cost` is too large")
      .option("side", &LockingOptions::side, "side of the leg: the drill comes from its outer side",
              one_of({"unknown", "left", "right"}))
      .option("from", &LockingOptions::from,
              "direction in the world from which the drill comes, [x, y, z]; empty: the outer side, a little from the "
              "front",
              unit(""))
      .option("guide_mm", &LockingOptions::guide_mm, "distance of the drill guide from the hole's centre", at_least(0))
      .option("max_angle_deg", &LockingOptions::max_angle_deg,
              "a hole is doubtful if its direction may be off by more than this (95 %)", at_least(0))
      .option("max_offset_mm", &LockingOptions::max_offset_mm,
              "a hole is doubtful if its axis may be off by more than this at its centre (95 %)", at_least(0))
      .option("max_cost", &LockingOptions::max_cost,
              "all holes are doubtful if `cost` at the nail's pose is above this", at_least(0))
      .option("isocentre_mm", &LockingOptions::isocentre_mm, "the C-arm's centre of rotation, as for camera.carm")
      .option("source_to_isocentre_mm", &LockingOptions::source_to_isocentre_mm,
              "distance from the C-arm's source to its centre of rotation, as for camera.carm", at_least(1));
}
