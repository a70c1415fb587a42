// SPDX-License-Identifier: Apache-2.0
#pragma once
// The search for the pose of least cost, coarse to fine, that the nodes of this kind share.
#include <memory>
#include <utility>
#include <vector>

#include "marrow/plugin.hpp"

namespace marrow::search {

struct SearchOptions {
  double scan_rotation_deg = 15;
  double scan_rotation_step_deg = 3;
  double scan_translation_mm = 15;
  double scan_translation_step_mm = 3;
  int scan_poses = 0;
  double scan_side_deg = 3;
  double scan_side_mm = 3;
  double scan_reach = 0.5;  ///< of the ranges of scan_poses: within it, two poses are neighbours
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

/// Throws Error unless all options that say something per level say it in positive numbers.
void check_options(const SearchOptions& options);
/// Throws Error unless the list has a number, and all are positive.
void check_level_list(const std::vector<double>& values, const std::string& name);

using Levels = std::vector<std::shared_ptr<const Cost>>;
Levels levels_of(const Cost& cost, const SearchOptions& options);

/// Where a candidate came to: cost, and poses after the axial and after the last search.
struct Found {
  double value = 0;
  RigidTransform axial, pose;
};

/// How long the first steps of a search are, and when it ends.
struct Steps {
  double deg = 1, axial_deg = 1, mm = 1, tolerance = 0.1;
};

/// The search: the pose found so far, moved about the fragment's own axes.
class Search {
 public:
  Search(const Optimizer& optimizer, const Pose& initial, const SearchOptions& options, Context& context);

  const RigidTransform& pose() const { return pose_; }
  void go_to(const RigidTransform& pose) { pose_ = pose; }
  int evaluations() const { return evaluations_; }

  /// The least cost on the way so far; costs of different levels do not compare, so this asks one for all.
  std::vector<Pose::Progress> convergence(const Cost& cost) const;

  /// Looks at poses about the one found so far, follows the best up, and returns where the best of them came to, at the
  /// last level.
  Found find(const Levels& levels) { return best_of(scan(*levels.front()), levels); }

  /// Minimises over the given axes (0 to 2 rotations, 3 to 5 translations) from the pose found so far, goes there and
  /// returns the cost. `done` and `share` are for the progress.
  double refine(const Cost& cost, const std::vector<int>& axes, const Steps& steps, double done, double share);

 private:
  /// Tries poses about the one found so far and returns the best that are no neighbours of a better one: the cost has
  /// other minima within their range.
  std::vector<RigidTransform> scan(const Cost& cost);

  /// Follows the candidates up. Each is judged after all six axes had their turn, because the start's errors in the
  /// other four hide which of them is right; the finalists are judged at the last level, because a coarse cost hardly
  /// tells a good pose from one whose outline lies on other things in the image.
  Found best_of(const std::vector<RigidTransform>& candidates, const Levels& levels);

  void note(int evaluations, const RigidTransform& pose);
  Steps steps_of(std::size_t level) const;

  const Optimizer& optimizer_;
  const FragmentFrame& frame_;
  RigidTransform pose_;
  const SearchOptions& options_;
  Context& context_;
  int evaluations_ = 0;
  std::vector<std::pair<int, RigidTransform>> path_;  ///< after so many evaluations
};

/// The search's pose with its cost, and, where the cost has a noise model, its predicted covariance and warnings of
/// what the images do not determine.
Pose pose_of(const Search& search, const Pose& initial, const Cost& cost);
Pose final_pose_of(const Search& search, const Pose& initial, const Cost& cost, const SearchOptions& options,
                   Context& context);

inline const std::vector<int> kAllAxes{0, 1, 2, 3, 4, 5};

/// Declares the options of the search.
template <class Options, class Node>
Node& declare(Node& node) {
  return node
      .option("scan_rotation_deg", &Options::scan_rotation_deg, "axial rotations tried, to either side",
              marrow::at_least(0), marrow::at_most(180))
      .option("scan_rotation_step_deg", &Options::scan_rotation_step_deg, "distance between these",
              marrow::at_least(0.01))
      .option("scan_translation_mm", &Options::scan_translation_mm, "axial translations tried, to either side",
              marrow::at_least(0))
      .option("scan_translation_step_mm", &Options::scan_translation_step_mm, "distance between these",
              marrow::at_least(0.01))
      .option("scan_poses", &Options::scan_poses,
              "instead of this grid, so many poses spread over all six axes: for a start that is approximate in all",
              marrow::at_least(0))
      .option("scan_side_deg", &Options::scan_side_deg,
              "of these, rotations about the frontal and lateral axes, to either side", marrow::at_least(0),
              marrow::at_most(180))
      .option("scan_side_mm", &Options::scan_side_mm, "of these, translations along the same axes, to either side",
              marrow::at_least(0))
      .option("candidates", &Options::candidates, "best places of this scan that are followed up", marrow::at_least(1))
      .option("finalists", &Options::finalists,
              "best of these after the first level that go through all levels; the last level chooses",
              marrow::at_least(1))
      .option("contour_spacing_px", &Options::contour_spacing_px, "per level: distance between points of the outline")
      .option("reach_px", &Options::reach_px, "per level: distance from which on a point counts as unmatched")
      .option("pixel_step", &Options::pixel_step,
              "per level, of grey values: every how many pixels are compared; none: as the cost says")
      .option("step_deg", &Options::step_deg,
              "per level: first step of the rotations about the frontal and lateral axes")
      .option("step_axial_deg", &Options::step_axial_deg,
              "per level: first step of the axial rotation, which moves the outline less")
      .option("step_mm", &Options::step_mm, "per level: first step of the translations")
      .option("max_evaluations", &Options::max_evaluations, "most evaluations of the cost per level",
              marrow::at_least(1))
      .option("step_tolerance", &Options::step_tolerance,
              "per level: it ends when steps fall below this part of its first step")
      .relation(marrow::same_length(
          {"contour_spacing_px", "reach_px", "step_deg", "step_axial_deg", "step_mm", "step_tolerance"}))
      .relation(marrow::as_many_or_none("pixel_step", "contour_spacing_px"))
      .option("warn_above_deg", &Options::warn_above_deg,
              "predicted standard deviation of a rotation that gives a warning", marrow::at_least(0))
      .option("warn_above_mm", &Options::warn_above_mm,
              "predicted standard deviation of a translation that gives a warning", marrow::at_least(0));
}

}  // namespace marrow::search
