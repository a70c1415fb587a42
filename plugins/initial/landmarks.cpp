// SPDX-License-Identifier: Apache-2.0
// A start from landmarks that were marked in one view or more, by a person or a network. First poses are computed in
// several ways: from points that two views show, and from each view alone. Each is refined over all views at once. The
// best one is the result. Landmarks that the others contradict are left out.
#include <algorithm>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/plugin.hpp>
#include <set>
#include <vector>

#include "marrow/initial/reprojection_fit.hpp"
#include "marrow/toolbox/geometry/rigid_fit.hpp"

namespace {

using namespace marrow;
using namespace initial;

// Which landmarks agree on one pose. A network, or a tired person, may put one of them in a wrong place, and least
// squares would follow it.

/// A sight farther than this many of its deviations from where the others' pose shows it is wrong.
constexpr double kMostDeviations = 5;

constexpr std::size_t kLeastSights = 6;
constexpr double kMostVariance = 4;  // of least squares with all sights, in units of that which is stated
constexpr double kBound = kMostDeviations * kMostDeviations;  // c^2 of the paper

/// The sights with more deviation, so that their squares count by these weights. Those without weight are left out.
std::vector<Sight> weighted(const std::vector<Sight>& sights, const std::vector<double>& weights) {
  std::vector<Sight> result;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (weights[i] <= 0) continue;
    result.push_back(sights[i]);
    result.back().deviation_px /= std::sqrt(weights[i]);
  }
  return result;
}

/// The pose of least truncated squares near a pose. The control parameter grows from nearly convex to truncated.
RigidTransform without_wrong(const std::vector<Sight>& sights, RigidTransform pose, const FragmentFrame& frame) {
  constexpr double kGrowth = 1.4;  // as in the paper
  constexpr int kMostSteps = 100;
  double largest = 0;
  for (const Sight& sight : sights) largest = std::max(largest, square_of(sight, pose));
  if (!std::isfinite(largest) || largest <= kBound) return pose;
  std::vector<double> weights(sights.size());
  double control = kBound / (2 * largest - kBound);
  for (int step = 0; step < kMostSteps; ++step, control *= kGrowth) {
    bool is_decided = true;
    for (std::size_t i = 0; i < sights.size(); ++i) {
      const double square = square_of(sights[i], pose);
      if (square >= (control + 1) / control * kBound)
        weights[i] = 0;
      else if (square <= control / (control + 1) * kBound)
        weights[i] = 1;
      else
        weights[i] = std::sqrt(kBound / square * control * (control + 1)) - control, is_decided = false;
    }
    const std::vector<Sight> kept = weighted(sights, weights);
    if (kept.size() < 4) return pose;
    pose = refined(kept, pose, frame);
    if (is_decided) break;
  }
  return pose;
}

double truncated_squares(const std::vector<Sight>& sights, const RigidTransform& pose) {
  double sum = 0;
  for (const Sight& sight : sights) sum += std::min(kBound, square_of(sight, pose));
  return sum;
}

/// Minima from all sights, and from those without each name, of which one is without the wrong one.
std::vector<Candidate> starts_of(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  std::vector<Candidate> starts;
  const auto add = [&](const std::vector<Sight>& some) {
    try {
      for (const Candidate& one : minima(some, frame)) starts.push_back(one);
    } catch (const Error&) {  // the mirror image, because of the wrong one
    }
  };
  add(sights);
  std::set<std::string> names;
  for (const Sight& sight : sights) names.insert(sight.name);
  for (const std::string& name : names) {
    std::vector<Sight> others;
    std::copy_if(sights.begin(), sights.end(), std::back_inserter(others),
                 [&](const Sight& sight) { return sight.name != name; });
    add(others);
  }
  return starts;
}

/// For each sight, whether it agrees with the pose that most of them agree on. All are true for fewer than six sights,
/// and if least squares of all of them leave none farther than kMostDeviations and twice the stated deviations at most.
/// All are true, too, if more than a third would be wrong: then it is not known which are.
///
/// The pose minimises the truncated squares by graduated non-convexity (Yang, Antonante, Tzoumas and Carlone, IEEE RA-L
/// 5, 2020, Section IV with the weights of Eq 14), from the starts of all sights and of those without each name.
std::vector<bool> agreeing_sights(const std::vector<Sight>& sights, const FragmentFrame& frame) {
  const std::vector<bool> all(sights.size(), true);
  if (sights.size() < kLeastSights) return all;
  const auto agrees = [](const Sight& sight, const RigidTransform& pose) { return square_of(sight, pose) <= kBound; };
  try {
    const std::vector<Candidate> found = minima(sights, frame);
    const double freedom = 2 * double(sights.size()) - 6;
    if (!found.empty() && found.front().squares <= kMostVariance * freedom &&
        std::all_of(sights.begin(), sights.end(),
                    [&](const Sight& sight) { return agrees(sight, found.front().pose); }))
      return all;
  } catch (const Error&) {  // the mirror image: perhaps because of a wrong one
  }
  RigidTransform best;
  double least = kBound * double(sights.size());
  for (const Candidate& start : starts_of(sights, frame)) {
    const RigidTransform pose = without_wrong(sights, start.pose, frame);
    if (const double value = truncated_squares(sights, pose); value < least) best = pose, least = value;
  }
  std::vector<bool> good;
  for (const Sight& sight : sights) good.push_back(least < kBound * double(sights.size()) && agrees(sight, best));
  const auto wrong = std::size_t(std::count(good.begin(), good.end(), false));
  return 3 * wrong > sights.size() ? all : good;
}

struct Options {
  double noise_px = 1;
};

/// The landmarks that the views show. Those that do not state their deviation have that of `noise_px`.
std::vector<Sight> sights_of(const Landmarks& landmarks, const List<View>& views, double noise_px,
                             const Context& context) {
  std::vector<Sight> sights;
  std::vector<std::string> unknown;
  for (const Landmarks::Seen& seen : landmarks.seen) {
    const auto point = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& one) { return one.name == seen.name; });
    if (point == landmarks.points.end())
      throw Error("view '" + seen.view + "' shows '" + seen.name +
                  "', but the landmarks have no point of that name in the CT; give its place there, or leave it out");
    if (const View* view = views.find(seen.view)) {
      check_camera(view->camera, "view '" + seen.view + "'");
      if (!std::isfinite(seen.deviation_px) || seen.deviation_px < 0)
        throw Error(
            formatted("the landmark '{}' in view '{}' has a deviation of {} px, which must be positive, or 0 where it "
                      "is not known",
                      seen.name, seen.view, seen.deviation_px));
      sights.push_back({seen.name, seen.view, point->model_mm, seen.pixel, &view->camera,
                        seen.deviation_px > 0 ? seen.deviation_px : noise_px});
    } else if (std::find(unknown.begin(), unknown.end(), seen.view) == unknown.end()) {
      unknown.push_back(seen.view);
      context.warn("landmarks are seen in a view '" + seen.view + "', which is none of the views; they are left out");
    }
  }
  return sights;
}

/// Throws Error if there are too few points for a pose, or if they lie on a line.
void check_enough(const std::vector<Sight>& sights) {
  std::vector<std::string> names, views;
  std::vector<Eigen::Vector3d> points;
  for (const Sight& sight : sights) {
    if (std::find(views.begin(), views.end(), sight.view) == views.end()) views.push_back(sight.view);
    if (std::find(names.begin(), names.end(), sight.name) != names.end()) continue;
    names.push_back(sight.name);
    points.push_back(sight.model_mm);
  }
  const std::size_t least = views.size() > 1 ? 3 : 4;
  if (names.size() < least)
    throw Error(formatted("{} landmarks are seen in {}; a pose needs three that are seen in two views, or four in one",
                          names.size(), counted(views.size(), "view")));
  geometry::check_spread(points, "the landmarks that are seen");
}

/// Root mean square of the distances in the images [px].
double root_mean_square_px(const std::vector<Sight>& sights, const RigidTransform& pose) {
  double sum = 0;
  for (const Sight& sight : sights) sum += (project(*sight.camera, pose * sight.model_mm) - sight.pixel).squaredNorm();
  return std::sqrt(sum / double(sights.size()));
}

/// Throws Error if another pose explains the landmarks nearly as well.
void check_unique(const std::vector<Candidate>& found, const std::vector<Sight>& sights) {
  constexpr double kSame_rad = 0.01;
  constexpr double kFactor_100 = 9.2;  // 2 ln 100: a pose that is a hundred times less likely is ignored
  for (const Candidate& other : found) {
    const double apart = geodesic_angle_rad(other.pose.rotation, found.front().pose.rotation);
    if (apart < kSame_rad || other.squares - found.front().squares > kFactor_100) continue;
    const auto rms = [&](const Candidate& one) { return short_number(root_mean_square_px(sights, one.pose)); };
    throw Error(
        formatted("two poses explain the landmarks: they differ by {:.3g} degrees, and leave {} and {} px. In one "
                  "view, points that lie nearly in a plane look the same tilted to either side; add a view, or a "
                  "landmark that lies off that plane",
                  degrees(apart), rms(found.front()), rms(other)));
  }
}

/// How far a sight is from where the pose shows it [px].
double off_px(const Sight& sight, const RigidTransform& pose) {
  return (project(*sight.camera, pose * sight.model_mm) - sight.pixel).norm();
}

/// Keeps the sights that agree on a pose, and says which do not.
std::vector<Sight> agreeing(const std::vector<Sight>& sights, const FragmentFrame& frame, std::vector<Sight>& wrong) {
  const std::vector<bool> agrees = agreeing_sights(sights, frame);
  std::vector<Sight> kept;
  for (std::size_t i = 0; i < sights.size(); ++i) (agrees[i] ? kept : wrong).push_back(sights[i]);
  return kept;
}

std::string residual_warning(const std::vector<Sight>& sights, const Pose& pose) {
  const auto deviations_off = [&](const Sight& sight) { return initial::square_of(sight, pose.world_from_model); };
  const Sight& worst = *std::max_element(sights.begin(), sights.end(), [&](const Sight& a, const Sight& b) {
    return deviations_off(a) < deviations_off(b);
  });
  double expected = 0;
  for (const Sight& sight : sights) expected += sight.deviation_px * sight.deviation_px / double(sights.size());
  return formatted(
      "the landmarks are {:.3g} px away from where this pose shows them ('{}' in view '{}' {:.3g} px), but {:.3g} px "
      "were expected; are two names exchanged, or is a camera wrong?",
      pose.cost, worst.name, worst.view, off_px(worst, pose.world_from_model), std::sqrt(expected));
}

/// What a user should know about the pose.
std::vector<std::string> warnings_of(const std::vector<Sight>& sights, const std::vector<Sight>& wrong,
                                     const Candidate& found, const Pose& pose) {
  constexpr double kMostDeviations = 3;
  std::vector<std::string> warnings;
  for (const Sight& sight : wrong)
    warnings.push_back(
        formatted("the landmark '{}' in view '{}' is left out: it is {:.3g} px from where the others say, and {:.3g} "
                  "px were expected; is it marked on another point?",
                  sight.name, sight.view, off_px(sight, found.pose), sight.deviation_px));
  if (found.squares > kMostDeviations * kMostDeviations * double(sights.size()))
    warnings.push_back(residual_warning(sights, pose));
  return warnings;
}

Pose landmarks(const Mesh& model, const Landmarks& landmarks, const List<View>& views, const Options& options,
               Context& context) {
  check_mesh(model, "model");
  const std::vector<Sight> all = sights_of(landmarks, views, options.noise_px, context);
  check_enough(all);
  Pose pose;
  pose.frame = fragment_frame(model);
  std::vector<Sight> wrong;
  const std::vector<Sight> sights = agreeing(all, pose.frame, wrong);
  check_enough(sights);
  const std::vector<Candidate> found = initial::minima(sights, pose.frame);
  if (found.empty())
    throw Error(
        "no pose was found for the landmarks: no view shows three of them, and no three are seen in two views; mark "
        "more of them");
  check_unique(found, sights);
  pose.world_from_model = found.front().pose;
  pose.world_from_model.source = model.frame;
  pose.cost = root_mean_square_px(sights, pose.world_from_model);
  pose.covariance = inverse_of_symmetric(initial::curvature_at(sights, pose.world_from_model, pose.frame));
  pose.warnings = warnings_of(sights, wrong, found.front(), pose);
  for (const std::string& warning : pose.warnings) context.warn(warning);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.landmarks", landmarks)
      .summary(
          "Pose with the least reprojection error of marked landmarks, over all views at once, with its predicted "
          "error")
      .in("model", "surface of the fragment; it gives the axes")
      .in("landmarks",
          "points in the CT and their marked pixels in the views; each counts by its deviation. Of six or more, those "
          "that the others contradict are left out")
      .in("views", "X-ray views; only their cameras are used", over("view"))
      .out("pose", "pose of least reprojection error; its cost is the root mean square of this error in pixels")
      .option("noise_px", &Options::noise_px,
              "expected standard deviation of each coordinate of a marked landmark that does not state its own; used "
              "for its weight, the covariance, the warnings, and to decide whether a second pose is possible too",
              at_least(1e-3));
}
