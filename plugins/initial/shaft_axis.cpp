// SPDX-License-Identifier: Apache-2.0
// The chapter's first stage (3.4): finds the bone's axis from the shaft lines of the views, and moves the model so that
// its axis coincides. The chapter back-projects at right angles to the image. Here the planes go through the X-ray
// source, which avoids an error of up to 20 mm (docs/method.md). The model's axis is measured anew in each round, from
// the silhouette of the model along the same parts of the same views. So a bow, a taper or a ridge shifts both axes by
// the same amount.
// An image may show the shafts of two fragments. Each fragment takes the best pair of lines at its own position. This
// may be a pair that the shaft node rejected in favour of a better one.
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/number_text.hpp"
#include "marrow/toolbox/shaft/axis.hpp"
#include "marrow/toolbox/shaft/model_borders.hpp"

namespace {

using namespace marrow::shaft;
using marrow::Camera, marrow::List, marrow::Mesh, marrow::Plane, marrow::Pose, marrow::RigidTransform,
    marrow::ShaftLines, marrow::View;

struct Options {
  int rounds = 10;
  double tolerance_mm = 1.0;
  double border_inset_mm = 0.5;
};

constexpr double kWidthTolerance = 0.15;  // a pair is not the model's if the widths differ by a larger fraction
constexpr double kLeastLength_mm = 25;    // at the isocentre

std::string number(double value) { return marrow::formatted("%.1f", value); }

/// Information from one view: the pair of borders, and the plane that contains the axis.
struct Sight {
  std::string name;
  const Camera* camera;
  ShaftLines lines;
  Plane plane;
};

/// Distance of a pair's borders in their middle, measured across them, with the inset added on both sides.
double width_px(const ShaftLines& lines, double inset_px) {
  const Eigen::Vector2d along =
      (lines.left.to_px - lines.left.from_px + lines.right.to_px - lines.right.from_px).normalized();
  const Eigen::Vector2d between =
      0.5 * (lines.right.from_px + lines.right.to_px - lines.left.from_px - lines.left.to_px);
  return std::abs(along.x() * between.y() - along.y() * between.x()) + 2 * inset_px;
}

/// The best pair of a view at the position of the model. This is the pair that the shaft node chose, if the model
/// appears there. Otherwise it is the first rejected pair that is as wide as the model and long enough to give a
/// direction.
ShaftLines lines_of_model(const Mesh& model, const RigidTransform& start, const Camera& camera, const ShaftLines& found,
                          const std::string& view, const Options& options) {
  const double pixel_mm = std::abs(marrow::pixel_size_at_mm(camera, Eigen::Vector3d::Zero()));
  const double tolerance_px = options.tolerance_mm / pixel_mm;
  if (model_borders(model, start, camera, found, tolerance_px)) return found;
  for (const ShaftLines::Rejected& other : found.rejected) {
    ShaftLines lines;
    lines.left = other.left;
    lines.right = other.right;
    if ((lines.left.to_px - lines.left.from_px).norm() * pixel_mm < kLeastLength_mm) continue;
    const auto borders = model_borders(model, start, camera, lines, tolerance_px);
    if (!borders) continue;
    const double width = width_px(lines, options.border_inset_mm / pixel_mm);
    if (std::abs(width - borders->width_px) < kWidthTolerance * borders->width_px) return lines;
  }
  throw marrow::Error("view '" + view +
                      "': where the image shows the shaft, the model at its start does not appear, nor does another "
                      "pair of lines fit it; give a start nearer to the bone");
}

std::vector<Sight> sights_of(const Mesh& model, const RigidTransform& start, const List<ShaftLines>& lines,
                             const List<View>& views, const Options& options) {
  if (lines.empty()) throw marrow::Error("there are no shaft lines; wire the lines of at least one view");
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::string& name = lines.name(i);
    const View* view = views.find(name);
    if (!view) throw marrow::Error("there are shaft lines of a view '" + name + "', but no view of that name");
    marrow::check_camera(view->camera, "view '" + name + "'");
    for (const marrow::LineSegment* border : {&lines[i].left, &lines[i].right})
      if (!border->from_px.allFinite() || !border->to_px.allFinite() || (border->to_px - border->from_px).norm() < 1)
        throw marrow::Error("view '" + name + "': a border of the shaft has no length");
    const ShaftLines own = lines_of_model(model, start, view->camera, lines[i], name, options);
    sights.push_back({name, &view->camera, own, bisecting_plane(view->camera, own.left, own.right)});
  }
  return sights;
}

/// The model's borders in every view, for a given pose.
std::vector<ModelBorders> borders_of(const Mesh& model, const RigidTransform& world_from_model,
                                     const std::vector<Sight>& sights, double tolerance_mm) {
  std::vector<std::optional<ModelBorders>> found(sights.size());
  tbb::parallel_for(std::size_t(0), sights.size(), [&](std::size_t i) {
    const double pixel_mm = marrow::pixel_size_at_mm(*sights[i].camera, Eigen::Vector3d::Zero());
    found[i] =
        model_borders(model, world_from_model, *sights[i].camera, sights[i].lines, tolerance_mm / std::abs(pixel_mm));
  });
  std::vector<ModelBorders> borders;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (!found[i])
      throw marrow::Error("view '" + sights[i].name +
                          "': where the image shows the shaft, the model at its start does not appear; "
                          "give a start nearer to the bone");
    borders.push_back(std::move(*found[i]));
  }
  return borders;
}

/// Two or more views: the planes intersect in the axis (Eq 7). This is done for the images and for the model.
RigidTransform move_by_planes(const std::vector<Sight>& sights, const std::vector<ModelBorders>& borders,
                              const Eigen::Vector3d& anchor) {
  std::vector<Plane> target, model;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    target.push_back(sights[i].plane);
    model.push_back(bisecting_plane(*sights[i].camera, borders[i].left, borders[i].right));
  }
  return world_from_world_move(axis_of_planes(model), axis_of_planes(target), anchor);
}

/// One view gives only the plane of the axis. The depth follows from the angle under which the bone's own width is
/// seen: for a cylinder r = D sin(half angle), so the depth is inversely proportional to the width in the image. The
/// inclination of the axis to the image plane stays unchanged.
RigidTransform move_by_width(const Sight& sight, const ModelBorders& borders, const Eigen::Vector3d& anchor,
                             double inset_mm) {
  const Eigen::Vector3d source = marrow::source_position_mm(*sight.camera);
  const double inset_px = inset_mm / marrow::pixel_size_at_mm(*sight.camera, anchor);
  const double nearer = borders.width_px / width_px(sight.lines, inset_px);
  // The model's own axis is projected to the plane between its borders. So a perfect start does not move.
  const Plane model_plane = bisecting_plane(*sight.camera, borders.left, borders.right);
  const auto into = [&](const Plane& plane, const Eigen::Vector3d& vector) {
    return Eigen::Vector3d(vector - plane.normal * plane.normal.dot(vector));
  };
  Axis model, target;
  model.direction = into(model_plane, borders.axis.direction).normalized();
  model.point_mm = source + into(model_plane, borders.axis.point_mm - source);
  target.direction = into(sight.plane, model.direction).normalized();
  target.point_mm = source + nearer * into(sight.plane, model.point_mm - source);
  return world_from_world_move(model, target, anchor);
}

/// Warnings, in words, about views whose lines do not fit this model.
std::vector<std::string> doubts(const std::vector<Sight>& sights, const std::vector<ModelBorders>& borders,
                                const Eigen::Vector3d& anchor, double inset_mm) {
  std::vector<std::string> warnings;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    const double pixel_mm = marrow::pixel_size_at_mm(*sights[i].camera, anchor);
    const double seen_mm = width_px(sights[i].lines, inset_mm / pixel_mm) * pixel_mm,
                 model_mm = borders[i].width_px * pixel_mm;
    if (sights.size() > 1 && std::abs(seen_mm - model_mm) > kWidthTolerance * model_mm)
      warnings.push_back("view '" + sights[i].name + "': the shaft's borders are " + number(seen_mm) +
                         " mm apart, where the model is " + number(model_mm) +
                         " mm wide; they may belong to something else");
    const Plane model = bisecting_plane(*sights[i].camera, borders[i].left, borders[i].right);
    const double turned_deg =
        marrow::degrees(std::acos(std::clamp(std::abs(model.normal.dot(sights[i].plane.normal)), 0.0, 1.0)));
    if (turned_deg > 1)
      warnings.push_back("view '" + sights[i].name + "': its shaft lines disagree with those of the other views by " +
                         number(turned_deg) + " degrees");
  }
  return warnings;
}

Pose shaft_axis(const Mesh& model, const List<ShaftLines>& lines, const List<View>& views, const Pose* start,
                const Options& options) {
  marrow::check_mesh(model, "model");
  Pose pose;
  if (start)
    pose.world_from_model = start->world_from_model;
  else
    pose.world_from_model.source = model.frame;
  marrow::check_rigid(pose.world_from_model, "start");
  const std::vector<Sight> sights = sights_of(model, pose.world_from_model, lines, views, options);
  pose.frame = marrow::fragment_frame(model);
  for (int round = 0; round < options.rounds; ++round) {
    const std::vector<ModelBorders> borders = borders_of(model, pose.world_from_model, sights, options.tolerance_mm);
    const Eigen::Vector3d anchor = pose.world_from_model * pose.frame.origin_mm;
    const RigidTransform move = sights.size() == 1
                                    ? move_by_width(sights[0], borders[0], anchor, options.border_inset_mm)
                                    : move_by_planes(sights, borders, anchor);
    pose.world_from_model = move * pose.world_from_model;
    ++pose.evaluations;
    const double shift_mm = (pose.world_from_model * pose.frame.origin_mm - anchor).norm();
    if (shift_mm < 1e-2 && marrow::geodesic_angle_rad(move.rotation, Eigen::Matrix3d::Identity()) < 1e-4) break;
  }
  pose.warnings = doubts(sights, borders_of(model, pose.world_from_model, sights, options.tolerance_mm),
                         pose.world_from_model * pose.frame.origin_mm, options.border_inset_mm);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("initial.shaft_axis", shaft_axis)
      .summary("Aligns the shaft axis of the model with that of the images (first stage of the chapter, Eq 7 and 8)")
      .in("model", "surface of the fragment")
      .in("lines", "outer borders of the shaft", marrow::over("view"))
      .in("views", "X-ray views; only their cameras are used", marrow::over("view"))
      .in("start", "nominal placement; its rotation about the axis and its position along the axis are kept")
      .out("pose", "pose: four degrees of freedom from the views, two from the start")
      .option("rounds", &Options::rounds, "largest number of rounds; each measures the model's axis again",
              marrow::at_least(1), marrow::at_most(100))
      .option("tolerance_mm", &Options::tolerance_mm,
              "largest distance, in mm at the isocentre, of a silhouette point from the model's border line",
              marrow::at_least(0.01))
      .option("border_inset_mm", &Options::border_inset_mm,
              "distance of a round bone's edge inside its outline, in mm at the isocentre, because attenuation begins "
              "gradually; it matters if a single view gives the depth from the width");
}
