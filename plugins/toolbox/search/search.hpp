// SPDX-License-Identifier: Apache-2.0
#pragma once
// Search for the pose of least cost, from coarse to fine. Several nodes use it.
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "marrow/plugin.hpp"

namespace marrow::search {

/// See the help texts in declare(). Vectors hold one number for each level, the coarsest first.
struct SearchOptions {
  double scan_rotation_deg = 15;
  double scan_rotation_step_deg = 3;
  double scan_translation_mm = 15;
  double scan_translation_step_mm = 3;
  int scan_poses = 0;
  double scan_side_deg = 3;
  double scan_side_mm = 3;
  double scan_reach = 0.5;  ///< two of the scan_poses are neighbours within this part of the scan's ranges
  int candidates = 3;
  int finalists = 1;
  std::vector<double> contour_spacing_px{8, 4, 2};
  std::vector<double> reach_px{24, 12, 6};
  std::vector<double> pixel_step;
  std::vector<double> step_deg{3, 1, 0.3};
  std::vector<double> step_axial_deg{6, 3, 1};
  std::vector<double> step_mm{3, 1, 0.3};
  int max_evaluations = 400;
  std::vector<double> step_tolerance{0.1, 0.1, 0.03};
  double warn_above_deg = 3;
  double warn_above_mm = 5;
};

/// Throws Error unless all lists with a number per level pass check_level_list(). pixel_step may be empty.
void check_options(const SearchOptions& options);
/// Throws Error unless the list holds at least one number and all are positive. The message begins with `name`.
void check_level_list(const std::vector<double>& values, const std::string& name);

/// The cost at each level, the coarsest first.
using Levels = std::vector<std::shared_ptr<const Cost>>;
Levels levels_of(const Cost& cost, const SearchOptions& options);

/// Result for one candidate: its cost, and its poses after the axial search and after the last search.
struct Found {
  double value = 0;
  RigidTransform axial, pose;
};

/// First steps of a search: of the rotations about the frontal and lateral axes, of the axial rotation, and of the
/// translations. About axes that are not anatomical all rotations begin with `deg`. The search ends when steps fall
/// below `tolerance` times the first ones.
struct Steps {
  double deg = 1, axial_deg = 1, mm = 1, tolerance = 0.1;
};

/// A search in progress. It keeps the best pose so far and moves it about the fragment's own axes. Refers to all
/// arguments of the constructor, which must outlive it.
class Search {
 public:
  Search(const Optimizer& optimizer, const Pose& initial, const SearchOptions& options, Context& context);

  const RigidTransform& pose() const { return pose_; }
  void go_to(const RigidTransform& pose) { pose_ = pose; }
  int evaluations() const { return evaluations_; }

  /// How the least cost fell during the search. All poses are evaluated by the same `cost`, because costs of different
  /// levels cannot be compared.
  std::vector<Pose::Progress> convergence(const Cost& cost) const;

  /// Scans poses around the current one, refines the best candidates through the levels, and returns the best result at
  /// the last level.
  Found find(const Levels& levels) { return best_of(scan(*levels.front()), levels); }

  /// Minimises over the given axes (0 to 2 rotations, 3 to 5 translations) from the current pose. Goes to the result
  /// and returns its cost. For the progress: `done` is the part of the whole search before this call, `share` that of
  /// this call. Throws when the context is cancelled.
  double refine(const Cost& cost, const std::vector<int>& axes, const Steps& steps, double done, double share);
  Steps steps_of(std::size_t level) const;

 private:
  /// Evaluates poses around the current one and returns the best. None of them is a neighbour of a better one, because
  /// the cost may have several minima in this range.
  std::vector<RigidTransform> scan(const Cost& cost);

  /// Refines the candidates. They are compared only after a search over all six axes, because errors of the start in
  /// the four other axes hide which candidate is right. The finalists are compared at the last level: a coarse cost
  /// hardly distinguishes a good pose from one whose outline lies on other structures in the image.
  Found best_of(const std::vector<RigidTransform>& candidates, const Levels& levels);

  void note(int evaluations, const RigidTransform& pose);

  const Optimizer& optimizer_;
  const FragmentFrame& frame_;
  RigidTransform pose_;
  const SearchOptions& options_;
  Context& context_;
  int evaluations_ = 0;
  std::vector<std::pair<int, RigidTransform>> path_;  ///< poses on the way, each after this number of evaluations
};

/// The search's pose with its cost and number of evaluations, without covariance. The rest is that of `initial`.
Pose pose_of(const Search& search, const Pose& initial, const Cost& cost);
/// The same at the end of a search, without the warnings of the start, and with the convergence. If the cost can leave
/// out blocks, also with the predicted covariance and with warnings about axes that the images hardly determine. Along
/// the direction that they determine least, the cost may have several minima, and the start decides in which the search
/// ends. So the others are refined with `steps`, and the search goes to the best of them. Throws Error if the images
/// say nothing about the pose (nothing_compared()); a view that says nothing, where others do, is a warning. `coarser`,
/// the same cost of grey values at a coarser level, saves time: PredictedCovariance says how.
Pose final_pose_of(Search& search, const Pose& initial, const Cost& cost, const Steps& steps,
                   const SearchOptions& options, Context& context, const Cost* coarser = nullptr);

inline const std::vector<int> kAllAxes{0, 1, 2, 3, 4, 5};

/// The pixel step at which grey values look around a result: coarse enough to be cheap, and fine enough to tell a
/// bone's other poses.
inline int coarser_pixel_step(double pixel_step) { return std::max(int(pixel_step), std::min(8, 4 * int(pixel_step))); }

/// Declares the options of the search.
template <class Options, class Node>
Node& declare(Node& node) {
  return node
      .option("scan_rotation_deg", &Options::scan_rotation_deg, "axial rotations tried, to either side",
              marrow::at_least(0), marrow::at_most(180))
      .option("scan_rotation_step_deg", &Options::scan_rotation_step_deg, "step between these rotations",
              marrow::at_least(0.01))
      .option("scan_translation_mm", &Options::scan_translation_mm, "axial translations tried, to either side",
              marrow::at_least(0))
      .option("scan_translation_step_mm", &Options::scan_translation_step_mm, "step between these translations",
              marrow::at_least(0.01))
      .option(
          "scan_poses", &Options::scan_poses,
          "number of poses spread over all six axes, tried instead of this grid, for a start that is approximate in "
          "all axes; 0: the grid",
          marrow::at_least(0))
      .option("scan_side_deg", &Options::scan_side_deg,
              "with scan_poses: rotations about the frontal and lateral axes, to either side", marrow::at_least(0),
              marrow::at_most(180))
      .option("scan_side_mm", &Options::scan_side_mm, "with scan_poses: translations along these axes, to either side",
              marrow::at_least(0))
      .option("candidates", &Options::candidates, "number of best poses of the scan that are refined",
              marrow::at_least(1))
      .option("finalists", &Options::finalists,
              "number of best candidates after the first level that go through all levels; the last level chooses",
              marrow::at_least(1))
      .option("contour_spacing_px", &Options::contour_spacing_px, "per level: distance between points of the outline",
              marrow::replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px, "per level: distance beyond which a point counts as unmatched",
              marrow::replaces({"reach_px", "reach_mm"}))
      .option("pixel_step", &Options::pixel_step,
              "per level, for grey values: compare every n-th pixel; none: as the cost says",
              marrow::replaces({"cost.pixel_step"}))
      .option("step_deg", &Options::step_deg,
              "per level: first step of the rotations about the frontal and lateral axes")
      .option("step_axial_deg", &Options::step_axial_deg,
              "per level: first step of the axial rotation, which moves the outline less")
      .option("step_mm", &Options::step_mm, "per level: first step of the translations")
      .option("max_evaluations", &Options::max_evaluations, "largest number of evaluations of the cost per level",
              marrow::at_least(1))
      .option("step_tolerance", &Options::step_tolerance,
              "per level: the search ends when steps fall below this part of the first step")
      .relation(marrow::same_length(
          {"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm", "step_tolerance"}))
      .relation(marrow::as_many_or_none("pixel_step", "contour_spacing_px"))
      .option("warn_above_deg", &Options::warn_above_deg,
              "predicted standard deviation of a rotation that gives a warning", marrow::at_least(0))
      .option("warn_above_mm", &Options::warn_above_mm,
              "predicted standard deviation of a translation that gives a warning", marrow::at_least(0));
}

/// Right Jacobian J of a rotation vector: R(r + dr) = R(r) R(J dr) for small dr.
inline Eigen::Matrix3d rotation_derivative(const Eigen::Vector3d& r_rad) {
  const double angle = r_rad.norm();
  const Eigen::Matrix3d cross = cross_matrix(r_rad);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() - 0.5 * cross;
  return Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * cross +
         (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
}

/// A cost's expansion about a pose that was moved by `deg_and_mm`, as a function of this motion's coordinates: degrees
/// and mm along `axes`. If the cost has no expansion there, the value is NaN.
inline MinimisationProblem::Expansion in_coordinates(const std::optional<Cost::Expansion>& about,
                                                     const Vector6d& deg_and_mm, const std::vector<int>& axes) {
  if (!about) return {std::numeric_limits<double>::quiet_NaN(), {}, {}};
  const Eigen::Vector3d r_rad = deg_and_mm.head<3>() * radians(1);
  Matrix6d motion_by_coordinates = Matrix6d::Zero();
  motion_by_coordinates.topLeftCorner<3, 3>() = rotation_derivative(r_rad) * radians(1);
  motion_by_coordinates.bottomRightCorner<3, 3>() = rotation_from_vector(r_rad).transpose();
  const Eigen::Matrix<double, 6, Eigen::Dynamic> chosen = motion_by_coordinates(Eigen::all, axes);
  return {about->value, chosen.transpose() * about->gradient, chosen.transpose() * about->curvature * chosen};
}

constexpr int kAxialRotation = 2, kAxialTranslation = 5;

/// Motions of the start that are tried first, in degrees and mm, and the reach within which two of them are neighbours.
struct Scan {
  std::vector<Vector6d> motions;
  Vector6d reach;  ///< half the sides of a box for a grid, else the half-axes of an ellipsoid
  bool grid = true;

  bool near(int a, int b) const {
    const Vector6d way = (motions[std::size_t(a)] - motions[std::size_t(b)]).cwiseQuotient(reach);
    return (grid ? way.cwiseAbs().maxCoeff() : way.norm()) <= 1;
  }
};

/// A grid of axial rotations and translations, because the first stage does not determine them.
inline Scan axial_scan(const SearchOptions& options) {
  const auto steps = [](double range, double step) { return int(std::floor(range / step + 1e-9)); };
  const int turns = steps(options.scan_rotation_deg, options.scan_rotation_step_deg);
  const int shifts = steps(options.scan_translation_mm, options.scan_translation_step_mm);
  Scan scan;
  for (int turn = -turns; turn <= turns; ++turn)
    for (int shift = -shifts; shift <= shifts; ++shift) {
      Vector6d motion = Vector6d::Zero();
      motion[kAxialRotation] = turn * options.scan_rotation_step_deg;
      motion[kAxialTranslation] = shift * options.scan_translation_step_mm;
      scan.motions.push_back(motion);
    }
  scan.reach = Vector6d::Ones();
  scan.reach[kAxialRotation] = 2.01 * options.scan_rotation_step_deg;
  scan.reach[kAxialTranslation] = 2.01 * options.scan_translation_step_mm;
  return scan;
}

/// The start itself, and motions in all six axes spread evenly over their ranges (Halton's sequence). For a start that
/// is only approximate in all six axes.
inline Scan scattered_scan(const SearchOptions& options) {
  Vector6d range;
  range << options.scan_side_deg, options.scan_side_deg, options.scan_rotation_deg, options.scan_side_mm,
      options.scan_side_mm, options.scan_translation_mm;
  const auto halton = [](int i, int base) {
    double value = 0, place = 1;
    for (; i > 0; i /= base) value += (place /= base) * (i % base);
    return value;
  };
  Scan scan;
  for (int i = 0; i < options.scan_poses; ++i) {
    Vector6d motion = Vector6d::Zero();
    constexpr std::array<int, 6> kBases{2, 3, 5, 7, 11, 13};
    for (int axis = 0; i > 0 && axis < 6; ++axis)
      motion[axis] = range[axis] * (2 * halton(i, kBases[std::size_t(axis)]) - 1);
    scan.motions.push_back(motion);
  }
  scan.reach = options.scan_reach * range.cwiseMax(1e-9);
  scan.grid = false;
  return scan;
}

/// A cost that has compared nothing is the same at all poses around. Any of them would pass for its minimum, with a
/// deviation of 0. Why the images say nothing about a pose: what the cost itself says, or that it is not a number
/// there, or the same at all poses 0.5 to 16 degrees and mm away along the axes of `frame`. Empty if they say
/// something.
std::string nothing_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame);
/// Throws Error if the images say nothing about a pose that was found.
void check_compared(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame);
/// The error for this reason.
[[noreturn]] void refuse_pose(const std::string& why_nothing_is_compared,
                              const std::string& which = "the pose that was found");

/// Adds a warning for each view that says nothing about the pose, to the pose and to the log, unless the pose already
/// has it.
void warn_of_silent_views(const Cost& cost, Pose& pose, const Context& context);

}  // namespace marrow::search
