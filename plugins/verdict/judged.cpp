// SPDX-License-Identifier: Apache-2.0
#include "judged.hpp"

#include <tbb/parallel_for.h>
#include <marrow/domain/decompositions.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/toolbox/geometry/targets.hpp"
#include "marrow/toolbox/match/views_cost.hpp"
#include "marrow/toolbox/search/search.hpp"

namespace marrow::verdict {

double Judged::off_mm(const RigidTransform& other) const {
  return geometry::mean(geometry::target_errors_mm(other, pose.world_from_model, targets_mm));
}

double Judged::axial_deg(const RigidTransform& other) const {
  return std::abs(degrees(motion_between(pose.world_from_model, other, frame)[2]));
}

RigidTransform Judged::moved_by(const RigidTransform& from, const Vector6d& deg_and_mm) const {
  Vector6d motion = deg_and_mm;
  motion.head<3>() *= radians(1);
  return moved(from, frame, motion);
}

std::vector<RigidTransform> near_starts(const Judged& judged) {
  constexpr double kMotions[][6] = {{1.5, -1.5, 4, 2, -2, 2}, {-1.5, 1.5, -4, -2, 2, -2}, {2, 2, -6, -1, -1, 3}};
  std::vector<RigidTransform> starts;
  for (const auto& deg_and_mm : kMotions)
    starts.push_back(judged.moved_by(judged.pose.world_from_model, Vector6d::Map(deg_and_mm)));
  return starts;
}

Minimum minimum_near(const Judged& judged, const Cost& cost, const RigidTransform& from, const FirstSteps& steps,
                     int max_evaluations) {
  judged.context->check_cancelled();
  MinimisationProblem problem;
  const auto at = [&](const Eigen::VectorXd& x) { return judged.moved_by(from, Vector6d(x)); };
  problem.function = [&](const Eigen::VectorXd& x) { return cost.value(at(x)); };
  if (cost.expansion(from, judged.frame))
    problem.expansion = [&](const Eigen::VectorXd& x) {
      return search::in_coordinates(cost.expansion(at(x), judged.frame), Vector6d(x), search::kAllAxes);
    };
  problem.start = Eigen::VectorXd::Zero(6);
  problem.initial_step = Eigen::VectorXd::Constant(6, steps.mm);
  problem.initial_step.head<3>() << steps.deg, steps.deg, steps.axial_deg;
  problem.max_evaluations = max_evaluations;
  problem.step_tolerance = steps.tolerance;
  const MinimisationResult result = judged.optimizer->minimise(problem);
  return {at(result.x), result.value};
}

// Bones cannot be in one place. Where two registered bones intersect, one of the poses is wrong.

double intersection_mm(const Judged& judged, const Mesh& mesh, const List<Pose>& others,
                       const List<SignedField>& other_bones) {
  constexpr std::size_t kPoints = 2000;
  const std::vector<Eigen::Vector3d> points_mm = sample_surface(mesh, kPoints);
  double deepest_mm = 0;
  for (std::size_t i = 0; i < others.size(); ++i) {
    const RigidTransform& pose = others[i].world_from_model;
    if (pose.rotation == judged.pose.world_from_model.rotation &&
        pose.translation_mm == judged.pose.world_from_model.translation_mm)
      continue;  // the bone itself
    const SignedField* bone = other_bones.find(others.name(i));
    if (!bone) throw Error("other_bones has no '" + others.name(i) + "'; give it the same fragments as others");
    if (bone->grid.frame != pose.source)
      throw Error("other_bones: '" + others.name(i) + "' is in frame '" + bone->grid.frame + "', but its pose takes '" +
                  pose.source + "'; give the field of the bone that was registered");
    const RigidTransform other_from_model = inverse(pose) * judged.pose.world_from_model;
    for (const Eigen::Vector3d& point : points_mm) {
      const Eigen::Vector3d index = bone->grid.index_from_point(other_from_model * point);
      const Eigen::Vector3d last = Eigen::Vector3i(bone->grid.size.data()).cast<double>().array() - 1;
      if ((index.array() < 0).any() || (index.array() > last.array()).any()) continue;
      deepest_mm = std::max(deepest_mm, -double(sample_trilinear(bone->grid, bone->values_mm, index)));
    }
  }
  return deepest_mm;
}

// How the cost changes around a pose. At the right pose it lies far below the cost of all other poses; near a wrong one
// it is hardly lower than elsewhere.

namespace {

constexpr double kTurnStep_deg = 10;
constexpr double kNearTurn_deg = 15;  ///< nearer poses belong to the same minimum
constexpr int kDecoys = 48;
constexpr double kNearestDecoy_mm = 4, kFarthestDecoy_mm = 24;

/// Poses in random directions, at distances (mTRE) spread evenly in their logarithm.
std::vector<RigidTransform> decoys(const Judged& judged) {
  Random random(1);
  std::vector<RigidTransform> poses;
  for (int i = 0; i < kDecoys; ++i) {
    Vector6d motion;
    for (double& one : motion) one = random.normal();
    motion.tail<3>() *= 2;
    motion[2] *= 2;  // the bone is slender: a rotation about its long axis moves its surface least
    const double wanted_mm =
        kNearestDecoy_mm * std::pow(kFarthestDecoy_mm / kNearestDecoy_mm, (i + 0.5) / double(kDecoys));
    const double off_mm = judged.off_mm(judged.moved_by(judged.pose.world_from_model, motion));
    poses.push_back(judged.moved_by(judged.pose.world_from_model, motion * (wanted_mm / off_mm)));
  }
  return poses;
}

/// 0 if the best of the others is as bad as their median; 1 if it is as good as the pose; more if it is better.
double closeness(double best_other, double own, double median) {
  constexpr double kMost = 3;
  if (!(median > own)) return kMost;
  return std::clamp(1 - (best_other - own) / (median - own), 0.0, kMost);
}

}  // namespace

Evidence landscape(const Judged& judged, const Cost& cost, const std::string& prefix) {
  std::vector<RigidTransform> poses{judged.pose.world_from_model};
  const std::vector<RigidTransform> others = decoys(judged);
  poses.insert(poses.end(), others.begin(), others.end());
  for (double turn_deg = kNearTurn_deg; turn_deg <= 360 - kNearTurn_deg; turn_deg += kTurnStep_deg) {
    Vector6d motion = Vector6d::Zero();
    motion[2] = turn_deg;
    poses.push_back(judged.moved_by(judged.pose.world_from_model, motion));
  }
  const std::vector<double> values = cost.values(poses);
  const double own = values[0];
  const std::vector<double> of_decoys(values.begin() + 1, values.begin() + 1 + kDecoys);
  const std::vector<double> of_turn(values.begin() + 1 + kDecoys, values.end());
  const double median = quantile(of_decoys, 0.5);
  const double scatter = quantile(of_decoys, 0.84) - quantile(of_decoys, 0.16);
  const auto least = [](const std::vector<double>& of) { return *std::min_element(of.begin(), of.end()); };
  constexpr double kMostScatter = 10;
  return {
      {prefix + "decoys_scatter", median > own ? std::min(scatter / (median - own), kMostScatter) : kMostScatter, ""},
      {prefix + "best_decoy", closeness(least(of_decoys), own, median), ""},
      {prefix + "best_turned", closeness(least(of_turn), own, median), ""}};
}

// Searches from elsewhere. Those from near must come back to the pose; those from far must not end in a cost as low.

namespace {

constexpr double kSame_mm = 1.5, kSame_deg = 4;  ///< a minimum within both is that of the pose
constexpr double kMost = 3;

Vector6d motion(double frontal, double lateral, double axial, double x, double y, double z) {
  Vector6d one;
  one << frontal, lateral, axial, x, y, z;
  return one;
}

/// Motions to the far starts, in degrees and mm.
std::vector<Vector6d> far_motions() {
  return {motion(0, 0, 15, 0, 0, 0),  motion(0, 0, -15, 0, 0, 0), motion(0, 0, 35, 0, 0, 0),
          motion(0, 0, -35, 0, 0, 0), motion(0, 0, 180, 0, 0, 0), motion(0, 0, 0, 0, 0, 12),
          motion(0, 0, 0, 0, 0, -12), motion(6, 0, 0, 0, 6, 0),   motion(0, -6, 0, -6, 0, 0)};
}

/// The cost's value at the pose, and how far the cost typically rises above it at the starts.
struct Scale {
  double own, rise;
  Scale(const Judged& judged, const Cost& cost, const std::vector<RigidTransform>& starts)
      : own(cost.value(judged.pose.world_from_model)), rise(quantile(cost.values(starts), 0.5) - own) {}
  /// 0: no better than the starts; 1: as good as the pose; above 1: better.
  double closeness(double value) const { return rise > 0 ? std::clamp(1 - (value - own) / rise, 0.0, kMost) : kMost; }
};

}  // namespace

Evidence other_minima(const Judged& judged, const Cost& coarse, const Cost& cost) {
  constexpr double kWorthRefining = 0.5;
  std::vector<RigidTransform> starts = near_starts(judged);
  const std::size_t near_count = starts.size();
  for (const Vector6d& one : far_motions()) starts.push_back(judged.moved_by(judged.pose.world_from_model, one));
  const Scale coarse_scale(judged, coarse, starts), scale(judged, cost, starts);
  starts.push_back(judged.pose.world_from_model);
  std::vector<Minimum> found(starts.size());
  tbb::parallel_for(std::size_t(0), starts.size(), [&](std::size_t i) {
    found[i] = minimum_near(judged, coarse, starts[i], {2, 4, 2, 0.05}, 70);
    found[i].value = coarse_scale.closeness(found[i].value);
    const bool is_near = i < near_count || i + 1 == starts.size();
    if (!is_near && found[i].value < kWorthRefining) return;
    // Those from near go on to the end, because the place of an early stop would depend on the last digits of the pose.
    if (is_near)
      found[i] = minimum_near(judged, cost, found[i].pose, {0.5, 1, 0.5, 0.01}, 150);
    else
      found[i] = minimum_near(judged, cost, found[i].pose, {0.5, 1, 0.5, 0.05}, 40);
    found[i].value = scale.closeness(found[i].value);
  });
  double best_other = 0, best = 1;
  std::vector<double> near_mm, near_deg;
  for (std::size_t i = 0; i < found.size(); ++i) {
    const double off_mm = judged.off_mm(found[i].pose), axial_deg = judged.axial_deg(found[i].pose);
    if (i < near_count) near_mm.push_back(off_mm), near_deg.push_back(axial_deg);
    best = std::max(best, found[i].value);
    if (off_mm > kSame_mm || axial_deg > kSame_deg) best_other = std::max(best_other, found[i].value);
  }
  return {{"other_minimum", best_other, ""},
          {"better_minimum", best - 1, ""},
          {"apart_mm", judged.off_mm(found.back().pose), "mm"},
          {"apart_deg", judged.axial_deg(found.back().pose), "deg"},
          {"restarts_mm", *std::max_element(near_mm.begin(), near_mm.end()), "mm"},
          {"restarts_deg", *std::max_element(near_deg.begin(), near_deg.end()), "deg"}};
}

// Where a second cost leads from a pose. The way begins at the judged pose, not where its own search began. So the same
// pose always gets the same judgement.

namespace {

constexpr int kPoses = 112, kTerms = 28;  ///< a quadratic function of six numbers has 1 + 6 + 21 terms

/// A round of the way: how far poses around are spread, in units of degrees and mm, and the level of the cost.
struct Round {
  double spread, spacing_px, reach_px;
};
constexpr Round kRounds[] = {{1, 4, 12}, {0.7, 2, 6}, {0.5, 2, 6}};

/// The minimum of the quadratic function that fits best to a cost at many poses around one, in the units of `spread`.
/// A contour's cost is rough: a search would end at any of many places beside each other, by the last digits of where
/// it began. The fit looks over the rough ground.
Vector6d minimum_of_fit(const Judged& judged, const Cost& cost, const RigidTransform& around, const Vector6d& spread) {
  constexpr double kLeastCurvature = 0.05, kFarthest = 2;
  Random random(1);
  Eigen::MatrixXd terms(kPoses, kTerms);
  std::vector<RigidTransform> poses;
  for (int i = 0; i < kPoses; ++i) {
    Vector6d u;
    for (double& one : u) one = random.normal();
    poses.push_back(judged.moved_by(around, u.cwiseProduct(spread)));
    terms(i, 0) = 1;
    terms.row(i).segment<6>(1) = u.transpose();
    for (int a = 0, term = 7; a < 6; ++a)
      for (int b = 0; b <= a; ++b) terms(i, term++) = u[a] * u[b];
  }
  const std::vector<double> values = cost.values(poses);
  const Eigen::VectorXd right = Eigen::Map<const Eigen::VectorXd>(values.data(), kPoses);
  const Eigen::VectorXd fit = least_squares(terms, right);
  const Vector6d slope = fit.segment<6>(1);
  Matrix6d curvature = Matrix6d::Zero();
  for (int a = 0, term = 7; a < 6; ++a)
    for (int b = 0; b <= a; ++b, ++term) {
      curvature(a, b) += fit[term];
      curvature(b, a) += fit[term];
    }
  const SymmetricEigen<6> eigen = eigen_of_symmetric(curvature);
  if (!(eigen.values[5] > 0)) return slope.norm() > 0 ? Vector6d(-kFarthest * slope.normalized()) : Vector6d::Zero();
  Vector6d way = Vector6d::Zero();
  for (int k = 0; k < 6; ++k)
    way -= eigen.vectors.col(k) * eigen.vectors.col(k).dot(slope) /
           std::max(eigen.values[k], kLeastCurvature * eigen.values[5]);
  return way.allFinite() ? Vector6d(way * std::min(1.0, kFarthest / std::max(way.norm(), 1e-12))) : Vector6d::Zero();
}

}  // namespace

Apart second_cost(const Judged& judged, const Cost& cost) {
  Vector6d unit;
  unit << 1, 1, 2, 1, 1, 1;  // degrees and mm: a slender bone is turned far about its long axis
  RigidTransform there = judged.pose.world_from_model;
  for (const Round& round : kRounds) {
    const auto level = cost.at_level({round.spacing_px, round.reach_px, 0});
    const Vector6d spread = round.spread * unit;
    there = judged.moved_by(there, minimum_of_fit(judged, *level, there, spread).cwiseProduct(spread));
  }
  return {judged.off_mm(there), judged.axial_deg(there)};
}

// Where each view alone would move the bone. Every view agrees with the right pose; the views of a wrong pose, of a
// wrong camera or of another bone each pull in another direction.

namespace {

/// The pose after a motion in the plane of a view's image: a turn about the line of sight through the bone, and shifts
/// along the image's axes.
RigidTransform moved_in_view(const Judged& judged, const Camera& camera, const Eigen::Vector3d& deg_and_mm) {
  const RigidTransform& pose = judged.pose.world_from_model;
  const Eigen::Matrix3d world_from_camera = camera.camera_from_world.rotation.transpose();
  const Eigen::Vector3d centre = pose * judged.frame.origin_mm;
  const Eigen::Matrix3d turn = rotation_from_vector(world_from_camera.col(2) * radians(deg_and_mm[0]));
  RigidTransform result = pose;
  result.rotation = turn * pose.rotation;
  result.translation_mm = turn * (pose.translation_mm - centre) + centre + world_from_camera.col(0) * deg_and_mm[1] +
                          world_from_camera.col(1) * deg_and_mm[2];
  return result;
}

/// The quadratic model of the cost in a view, for motions as moved_in_view() takes them, after one of them.
MinimisationProblem::Expansion in_view_coordinates(const Judged& judged, const Camera& camera,
                                                   const RigidTransform& pose,
                                                   const std::optional<match::ViewsCost::ViewExpansion>& about) {
  if (!about) return {std::numeric_limits<double>::quiet_NaN(), {}, {}};
  const Eigen::Matrix3d frame_from_camera =
      (camera.camera_from_world.rotation * pose.rotation * judged.frame.axes).transpose();
  Eigen::Matrix<double, 6, 3> motion = Eigen::Matrix<double, 6, 3>::Zero();
  motion.col(0).head<3>() = radians(1) * frame_from_camera.col(2);
  motion.col(1).tail<3>() = frame_from_camera.col(0);
  motion.col(2).tail<3>() = frame_from_camera.col(1);
  return {about->whole.value, motion.transpose() * about->whole.gradient,
          motion.transpose() * about->whole.curvature * motion};
}

/// How far the view would move the bone in its image: mTRE.
double pull_mm(const Judged& judged, const Cost& cost, std::size_t view, const Camera& camera) {
  judged.context->check_cancelled();
  MinimisationProblem problem;
  problem.function = [&](const Eigen::VectorXd& x) {
    return cost.value_in_view(view, moved_in_view(judged, camera, Eigen::Vector3d(x)));
  };
  const auto* in_views = dynamic_cast<const match::ViewsCost*>(&cost);
  if (in_views && in_views->expansion_in_view(view, judged.pose.world_from_model, judged.frame))
    problem.expansion = [&](const Eigen::VectorXd& x) {
      const RigidTransform there = moved_in_view(judged, camera, Eigen::Vector3d(x));
      return in_view_coordinates(judged, camera, there, in_views->expansion_in_view(view, there, judged.frame));
    };
  problem.start = Eigen::VectorXd::Zero(3);
  problem.initial_step = Eigen::VectorXd::Constant(3, 1);
  problem.max_evaluations = 60;
  problem.step_tolerance = 0.03;
  return judged.off_mm(moved_in_view(judged, camera, Eigen::Vector3d(judged.optimizer->minimise(problem).x)));
}

/// How far the view would rotate the bone about its long axis, up to 16 degrees.
double pull_deg(const Judged& judged, const Cost& cost, std::size_t view) {
  constexpr int kSide = 8;
  constexpr double kStep_deg = 2;
  std::vector<double> values(2 * kSide + 1);
  tbb::parallel_for(0, 2 * kSide + 1, [&](int i) {
    Vector6d motion = Vector6d::Zero();
    motion[2] = kStep_deg * (i - kSide);
    values[std::size_t(i)] = cost.value_in_view(view, judged.moved_by(judged.pose.world_from_model, motion));
  });
  const int best = int(std::min_element(values.begin(), values.end()) - values.begin());
  double between = 0;
  if (best > 0 && best < 2 * kSide) {
    const double before = values[std::size_t(best - 1)], here = values[std::size_t(best)],
                 after = values[std::size_t(best + 1)], curvature = before - 2 * here + after;
    if (curvature > 0) between = 0.5 * (before - after) / curvature;
  }
  return std::abs(best - kSide + between) * kStep_deg;
}

}  // namespace

Evidence views_alone(const Judged& judged, const Cost& cost, const List<View>& views, const std::string& prefix) {
  if (cost.view_count() != views.size() || views.size() < 2) return {};
  std::vector<double> pulls_mm(views.size()), pulls_deg(views.size());
  tbb::parallel_for(std::size_t(0), views.size(), [&](std::size_t i) {
    pulls_mm[i] = pull_mm(judged, cost, i, views[i].camera);
    pulls_deg[i] = pull_deg(judged, cost, i);
  });
  const auto most = [](const std::vector<double>& of) { return *std::max_element(of.begin(), of.end()); };
  return {{prefix + "view_pull_mm", most(pulls_mm), "mm"}, {prefix + "view_pull_deg", most(pulls_deg), "deg"}};
}

}  // namespace marrow::verdict
