// SPDX-License-Identifier: Apache-2.0
// Corrects cameras that are a little off, together with the poses of the bones that they show. refinement.hpp says how.
#include <algorithm>
#include <array>
#include <cmath>
#include <marrow/base/names.hpp>
#include <string>
#include <vector>

#include "marrow/toolbox/search/search.hpp"
#include "refinement.hpp"

namespace {

using namespace marrow;
using namespace refine;

// What the images tell about a camera, in figures and in words. A motion m of what the camera shows comes from errors p
// of its parameters, m = G p, with p expected to have the covariance D. If the images leave m with the mean M and the
// covariance S, then p has the mean K M and the covariance D - K (G D G^T - S) K^T, with K = D G^T (G D G^T)^-1
// (Gaussian conditioning): errors that show the same motion share it as their variances tell.

/// A figure of a camera: a motion, or a parameter that may cause one.
struct Figure {
  const char *name, *unit, *words;
};
constexpr std::array<Figure, 9> kFigures{{{"rotation_u", "deg", "rotation about u"},
                                          {"rotation_v", "deg", "rotation about v"},
                                          {"rotation_depth", "deg", "rotation about the depth"},
                                          {"shift_u", "mm", "shift along u"},
                                          {"shift_v", "mm", "shift along v"},
                                          {"shift_depth", "mm", "shift along the depth"},
                                          {"focal", "percent", "focal length"},
                                          {"centre_u", "px", "principal point along u"},
                                          {"centre_v", "px", "principal point along v"}}};
using Numbers = Eigen::Matrix<double, 9, 1>;

std::string unit_of(const Figure& figure) { return std::string(figure.unit) == "percent" ? "%" : figure.unit; }

/// The names of the figures, as cameras.cpp declares them.
std::vector<std::string> figures() {
  std::vector<std::string> names;
  for (const std::string before : {"", "predicted_"})
    for (const Figure& figure : kFigures) names.push_back(before + figure.name + "_" + figure.unit);
  for (const Figure& figure : kFigures) names.push_back(std::string("determined_") + figure.name);
  return names;
}

/// The first three parameters: focal length and principal point.
struct Parameters {
  Eigen::Vector3d mean, deviation, expected;
};
Parameters parameters_of(const Sight& sight, const Vector6d& motion, const Matrix6d& covariance) {
  const Eigen::MatrixXd expected = sight.parameter_deviations.cwiseAbs2().asDiagonal(),
                        crossed = expected * sight.by_parameters.transpose();
  const Matrix6d of_motion = sight.by_parameters * crossed;
  const Eigen::MatrixXd gain = crossed * inverse_of_symmetric(of_motion);
  const Eigen::MatrixXd left = expected - gain * (of_motion - covariance) * gain.transpose();
  return {(gain * motion).head<3>(), left.diagonal().head<3>().cwiseMax(0).cwiseSqrt(),
          sight.parameter_deviations.head<3>()};
}

/// How much of what was expected the images took away: 0 if a number is as uncertain as before, 1 if it is known.
Numbers determined(const Numbers& deviation, const Numbers& expected) {
  Numbers share = Numbers::Zero();
  for (Eigen::Index i = 0; i < share.size(); ++i)
    if (expected[i] > 0) share[i] = std::max(0.0, 1 - std::pow(deviation[i] / expected[i], 2));
  return share;
}

Metrics metrics_of(const Sight& sight, const Vector6d& motion, const Matrix6d& covariance) {
  const Parameters parameters = parameters_of(sight, motion, covariance);
  Numbers mean, deviation, expected;
  mean << motion, parameters.mean;
  deviation << covariance.diagonal().cwiseSqrt(), parameters.deviation;
  expected << sight.deviation(), parameters.expected;
  const Numbers share = determined(deviation, expected);
  Metrics metrics;
  const std::vector<std::string> names = figures();
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[i], mean[Eigen::Index(i)], unit_of(kFigures[i])});
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[kFigures.size() + i], deviation[Eigen::Index(i)], unit_of(kFigures[i])});
  for (std::size_t i = 0; i < kFigures.size(); ++i)
    metrics.items.push_back({names[2 * kFigures.size() + i], 100 * share[Eigen::Index(i)], "%"});
  return metrics;
}

/// Which of the expected errors the images determine by at least half of their variance, and which they leave open.
std::vector<std::string> words_of(const std::string& view, const Sight& sight, const Matrix6d& covariance) {
  const Parameters parameters = parameters_of(sight, Vector6d::Zero(), covariance);
  Numbers deviation, expected;
  deviation << covariance.diagonal().cwiseSqrt(), parameters.deviation;
  expected << sight.deviation(), parameters.expected;
  const Numbers share = determined(deviation, expected);
  std::string known, open;
  for (std::size_t i = 0; i < kFigures.size(); ++i) {
    if (!(expected[Eigen::Index(i)] > 0)) continue;
    std::string& names = share[Eigen::Index(i)] < 0.5 ? open : known;
    names += (names.empty() ? "" : ", ") + std::string(kFigures[i].words) +
             formatted(" ({:.0f} %)", 100 * share[Eigen::Index(i)]);
  }
  std::vector<std::string> lines;
  if (!known.empty()) lines.push_back("view '" + view + "': the images determine its camera's " + known);
  if (!open.empty())
    lines.push_back("view '" + view + "': the images do not determine its camera's " + open +
                    "; what is expected of them counts in the poses' deviations");
  return lines;
}

struct Result {
  List<View> views;
  List<Pose> poses;
  List<Pose> relative;
  List<Metrics> motions;
};

void check_inputs(const List<View>& views, const List<Cost>& costs, const List<Pose>& poses,
                  const std::string& reference) {
  if (views.size() < 2)
    throw Error("there is one view only; a camera is corrected by comparing it with others, so give two views or more");
  for (const View& view : views) check_view(view);
  if (!reference.empty() && !views.find(reference))
    throw Error("reference_view: there is no view '" + reference + "'; " + suggestion(reference, views.names()));
  if (poses.empty()) throw Error("there is no bone; wire the pose of at least one");
  if (costs.names() != poses.names())
    throw Error("costs and poses are not of the same bones; wire both from nodes that are called for each fragment");
  for (std::size_t f = 0; f < poses.size(); ++f) {
    check_pose(poses[f], "the pose of '" + poses.name(f) + "'");
    if (costs[f].view_count() == 0)
      throw Error("the cost of '" + costs.name(f) +
                  "' cannot be split into views: it compares no views, or it holds more than them, such as a prior; "
                  "give the cost of the images alone");
    if (costs[f].view_count() != views.size())
      throw Error(formatted("the cost of '{}' compares {} views, but there are {}; make it of the same views",
                            costs.name(f), costs[f].view_count(), views.size()));
  }
}

void check_optional_inputs(const List<View>& views, const List<Cost>& costs, const List<Cost>* coarse_costs,
                           const List<geometry::CameraDeviations>* stated) {
  if (coarse_costs && coarse_costs->names() != costs.names())
    throw Error(
        "coarse_costs and costs are not of the same bones; wire both from nodes that are called for each fragment");
  for (std::size_t f = 0; coarse_costs && f < coarse_costs->size(); ++f)
    if ((*coarse_costs)[f].view_count() != views.size())
      throw Error(formatted("the coarse cost of '{}' compares {} views, but there are {}; make it of the same views",
                            coarse_costs->name(f), (*coarse_costs)[f].view_count(), views.size()));
  if (stated && stated->names() != views.names())
    throw Error("camera_deviations and views are not of the same views; wire both from the node that reads the views");
}

void warn_of_large(const std::string& view, const Vector6d& in_deviations, Context& context) {
  const double most = in_deviations.cwiseAbs().maxCoeff();
  if (most <= 3) return;
  const std::string text = formatted("{:.1f}", most);
  context.warn("view '" + view + "': its camera is off by " + text +
               " times what the options expect; is it the camera of this image, and are the poses right?");
}

/// Throws Error if the images say nothing about one of the bones: its pose and the cameras would stay as given.
void check_compared(const Refinement& refinement, const List<Pose>& poses) {
  for (std::size_t f = 0; f < poses.size(); ++f) {
    const std::string why = search::nothing_compared(refinement.level(f), refinement.state().poses[f], poses[f].frame);
    if (!why.empty())
      throw Error("the images say nothing about the pose of '" + poses.name(f) + "': " + why +
                  "; leave this bone out, or see whether its pose, its masks and its edges are right");
  }
}

Result refined(const List<View>& views, const List<Cost>& costs, const List<Pose>& poses,
               const List<Cost>* coarse_costs, const List<geometry::CameraDeviations>* stated, const Options& options,
               Context& context) {
  search::check_level_list(options.pixel_step, "pixel_step");
  check_inputs(views, costs, poses, options.reference_view);
  check_optional_inputs(views, costs, coarse_costs, stated);
  Refinement refinement(costs, poses, views, options, stated);
  check_compared(refinement, poses);
  refinement.search(coarse_costs ? *coarse_costs : costs, context);
  refinement.run(context);
  check_compared(refinement, poses);
  if (!refinement.converged())
    context.warn(
        formatted("the cameras still moved after {} iterations; raise max_iterations", options.max_iterations));
  const std::string text = formatted(
      "the cameras are off relative to each other by about {:.3g} times what the options expect", refinement.scale());
  context.info(text);
  Result result;
  for (std::size_t v = 0; v < views.size(); ++v) {
    // What the reference moves by is not its camera's: it is how much larger or smaller the bones look in it.
    const bool is_reference = views.name(v) == options.reference_view;
    const Vector6d motion = is_reference ? Vector6d(Vector6d::Zero()) : refinement.state().motions[v];
    View view = views[v];
    view.camera.camera_from_world = view.camera.camera_from_world * refinement.sight(v).motion(motion);
    view.camera.camera_from_world.rotation = nearest_rotation(view.camera.camera_from_world.rotation);
    result.views.add(views.name(v), view);
    const Matrix6d covariance = refinement.covariance_of_motion(v);
    result.motions.add(views.name(v), metrics_of(refinement.sight(v), motion, covariance));
    for (const std::string& line : words_of(views.name(v), refinement.sight(v), covariance)) context.info(line);
    warn_of_large(views.name(v), motion.cwiseQuotient(refinement.sight(v).deviation()), context);
  }
  for (std::size_t f = 0; f < poses.size(); ++f) {
    Pose pose = poses[f];
    pose.world_from_model = refinement.state().poses[f];
    const Vector6d unit = from_units(Vector6d::Ones());
    pose.covariance = unit.asDiagonal() * refinement.covariance_of_pose(f) * unit.asDiagonal();
    pose.cost = refinement.cost(f);
    pose.convergence.clear();
    search::warn_of_silent_views(refinement.level(f), pose, context);
    result.poses.add(poses.name(f), pose);
    pose.covariance = unit.asDiagonal() * refinement.covariance_beside_first(f) * unit.asDiagonal();
    result.relative.add(poses.name(f), pose);
  }
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("refine.cameras", refined)
      .summary("Corrects cameras that are a little off by the bones that their images show, together with the poses")
      .in("views", "X-ray views with the cameras that a calibration gives", over("view"))
      .in("costs", "cost of each bone's pose in these views", over("fragment"))
      .in("poses", "pose of each bone, from a registration", over("fragment"))
      .in("coarse_costs",
          "costs of contours in the same views, for the search that comes first where a camera may be off by more than "
          "reach_px; absent: costs",
          over("fragment"))
      .in("camera_deviations",
          "what is stated about each camera, as a camera file says it; it takes the place of the expected errors below",
          over("view"))
      .out("views", &Result::views, "the same images with corrected cameras", over("view"))
      .out("poses", &Result::poses,
           "poses that go with these cameras; their covariance includes the uncertainty of the cameras",
           over("fragment"))
      .out("relative", &Result::relative,
           "the same poses with their covariances relative to the first bone, whose own is zero: errors that all bones "
           "share do not count",
           over("fragment"))
      .out("motions", &Result::motions,
           "motion of each camera, about and along the axes of its image (u, v, depth), the errors of the focal length "
           "and of the principal point that are most probable with it, the predicted deviations of all, and how much "
           "of what is expected the images determine: 0 % if it is as uncertain as before",
           over("view"))
      .figures({"rotation_u_deg",
                "rotation_v_deg",
                "rotation_depth_deg",
                "shift_u_mm",
                "shift_v_mm",
                "shift_depth_mm",
                "focal_percent",
                "centre_u_px",
                "centre_v_px",
                "predicted_rotation_u_deg",
                "predicted_rotation_v_deg",
                "predicted_rotation_depth_deg",
                "predicted_shift_u_mm",
                "predicted_shift_v_mm",
                "predicted_shift_depth_mm",
                "predicted_focal_percent",
                "predicted_centre_u_px",
                "predicted_centre_v_px",
                "determined_rotation_u",
                "determined_rotation_v",
                "determined_rotation_depth",
                "determined_shift_u",
                "determined_shift_v",
                "determined_shift_depth",
                "determined_focal",
                "determined_centre_u",
                "determined_centre_v"})
      .option("turn_deg", &Options::turn_deg, "root mean square of the cameras' rotations", at_least(1e-6))
      .option("shift_mm", &Options::shift_mm, "root mean square of the cameras' shifts", at_least(1e-6))
      .option("focal_percent", &Options::focal_percent,
              "root mean square error of the focal lengths, such as 10 if the header gives no distance; it is "
              "corrected by a shift along the depth, which shows the bone in the same size",
              at_least(0))
      .option("centre_px", &Options::centre_px,
              "root mean square error of the principal points, such as 100 for a crop whose place is not known; it is "
              "corrected by a shift across the depth",
              at_least(0))
      .option("contour_spacing_px", &Options::contour_spacing_px,
              "for costs of contours: distance between two points of the outline", at_least(0.1),
              replaces({"contour_spacing_px", "ray_step"}))
      .option("reach_px", &Options::reach_px,
              "for costs of contours: a point with no edge within this distance counts as unmatched", at_least(0.1),
              replaces({"reach_px", "reach_mm"}))
      .option("pixel_step", &Options::pixel_step,
              "per level, for costs of grey values: only every n-th pixel is compared; the first level tells how far "
              "the cameras are off, and the last one decides the poses",
              at_least(1), replaces({"pixel_step"}))
      .option("max_iterations", &Options::max_iterations, "largest number of iterations", at_least(1))
      .option("reference_view", &Options::reference_view,
              "view whose camera is right and stays, such as the one that was calibrated with the robot; empty: no "
              "camera is known to be right");
}
