// SPDX-License-Identifier: Apache-2.0
// The chapter's first stage (3.4): finds the bone's axis from the shaft lines of the views, and moves the model so that
// its axis coincides. The chapter back-projects at right angles to the image. Here the planes go through the X-ray
// source, which avoids an error of up to 20 mm (docs/method.md). The model's axis is measured again in each round, from
// the silhouette of the model along the same parts of the same views. So a bow, a taper or a ridge shifts both axes by
// the same amount. An image may show the shafts of two fragments. Each fragment takes the best pair of lines at its own
// position. This may be a pair that the shaft node rejected in favour of a better one.
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/initial/axis.hpp"

namespace {

using namespace marrow::initial;
using marrow::Camera, marrow::List, marrow::Mesh, marrow::Plane, marrow::Pose, marrow::RigidTransform,
    marrow::ShaftLines, marrow::View;

struct Options {
  int max_iterations = 10;
  double tolerance_mm = 1.0;
  double border_inset_mm = 0.5;
};

constexpr double kWidthTolerance = 0.15;  // a pair is not the model's if the widths differ by a larger fraction
constexpr double kLeastLength_mm = 25;    // at the bone

/// Information from one view: the pair of borders, and the plane that contains the axis.
struct Sight {
  std::string name;
  const Camera* camera;
  ShaftLines lines;
  Plane plane;
};

Eigen::Vector2d along_pair(const ShaftLines& lines) {
  return (lines.left.to_px - lines.left.from_px + lines.right.to_px - lines.right.from_px).normalized();
}

/// The length in mm of a pixel across a pair of borders: the pixel's area over its length along them.
double across_mm(const Sight& sight, const Eigen::Vector3d& bone_mm) {
  const double pixel_mm = marrow::pixel_size_at_mm(*sight.camera, bone_mm);
  return pixel_mm * pixel_mm / marrow::offset_at_mm(*sight.camera, bone_mm, along_pair(sight.lines)).norm();
}

/// Distance of a pair's borders in their middle, measured across them, with the inset added on both sides.
double width_px(const ShaftLines& lines, double inset_px) {
  const Eigen::Vector2d along = along_pair(lines);
  const Eigen::Vector2d between =
      0.5 * (lines.right.from_px + lines.right.to_px - lines.left.from_px - lines.left.to_px);
  return std::abs(along.x() * between.y() - along.y() * between.x()) + 2 * inset_px;
}

/// The middle of the model in the world.
Eigen::Vector3d middle_of(const Pose& pose) { return pose.world_from_model * pose.frame.origin_mm; }

/// Size of a pixel at the bone. Throws Error unless it lies in front of the source.
double pixel_at_bone_mm(const Eigen::Vector3d& bone_mm, const Camera& camera, const std::string& view) {
  const double pixel_mm = marrow::pixel_size_at_mm(camera, bone_mm);
  if (!(pixel_mm > 0))
    throw marrow::Error("view '" + view +
                        "': the model does not lie in front of the X-ray source; give a start nearer to the bone");
  return pixel_mm;
}

/// The best pair of a view at the position of the model. This is the pair that the shaft node chose, if the model
/// appears there. Otherwise it is the first rejected pair that is as wide as the model and long enough to give a
/// direction.
ShaftLines lines_of_model(const Mesh& model, const Pose& start, const Camera& camera, const ShaftLines& found,
                          const std::string& view, const Options& options) {
  const double pixel_mm = pixel_at_bone_mm(middle_of(start), camera, view);
  const double tolerance_px = options.tolerance_mm / pixel_mm;
  if (model_borders(model, start.world_from_model, camera, found, tolerance_px)) return found;
  for (const ShaftLines::Rejected& other : found.rejected) {
    ShaftLines lines;
    lines.left = other.left;
    lines.right = other.right;
    if ((lines.left.to_px - lines.left.from_px).norm() * pixel_mm < kLeastLength_mm) continue;
    const auto borders = model_borders(model, start.world_from_model, camera, lines, tolerance_px);
    if (!borders) continue;
    const double width = width_px(lines, options.border_inset_mm / pixel_mm);
    if (std::abs(width - borders->width_px) < kWidthTolerance * borders->width_px) return lines;
  }
  throw marrow::Error("view '" + view +
                      "': the model at its start is not where the image shows the shaft, and no other pair of lines "
                      "fits it; give a start nearer to the bone");
}

std::vector<Sight> sights_of(const Mesh& model, const Pose& start, const List<ShaftLines>& lines,
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
std::vector<ModelBorders> borders_of(const Mesh& model, const Pose& pose, const std::vector<Sight>& sights,
                                     double tolerance_mm) {
  std::vector<std::optional<ModelBorders>> found(sights.size());
  tbb::parallel_for(std::size_t(0), sights.size(), [&](std::size_t i) {
    const double pixel_mm = pixel_at_bone_mm(middle_of(pose), *sights[i].camera, sights[i].name);
    found[i] = model_borders(model, pose.world_from_model, *sights[i].camera, sights[i].lines, tolerance_mm / pixel_mm);
  });
  std::vector<ModelBorders> borders;
  for (std::size_t i = 0; i < sights.size(); ++i) {
    if (!found[i])
      throw marrow::Error(
          "view '" + sights[i].name +
          "': the model at its start is not where the image shows the shaft; give a start nearer to the bone");
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
  const double inset_px = inset_mm / across_mm(sight, anchor);
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
    const double pixel_mm = across_mm(sights[i], anchor);
    const double seen_mm = width_px(sights[i].lines, inset_mm / pixel_mm) * pixel_mm,
                 model_mm = borders[i].width_px * pixel_mm;
    if (sights.size() > 1 && std::abs(seen_mm - model_mm) > kWidthTolerance * model_mm)
      warnings.push_back(
          marrow::formatted("view '{}': the shaft's borders are {:.1f} mm apart, where the model is {:.1f} mm wide; "
                            "they may belong to something else",
                            sights[i].name, seen_mm, model_mm));
    const Plane model = bisecting_plane(*sights[i].camera, borders[i].left, borders[i].right);
    const double turned_deg =
        marrow::degrees(std::acos(std::clamp(std::abs(model.normal.dot(sights[i].plane.normal)), 0.0, 1.0)));
    if (turned_deg > 1)
      warnings.push_back(
          marrow::formatted("view '{}': its shaft lines disagree with those of the other views by {:.1f} degrees",
                            sights[i].name, turned_deg));
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
  marrow::check_pose(pose, "start");
  pose.frame = marrow::fragment_frame(model);
  const std::vector<Sight> sights = sights_of(model, pose, lines, views, options);
  for (int round = 0; round < options.max_iterations; ++round) {
    const std::vector<ModelBorders> borders = borders_of(model, pose, sights, options.tolerance_mm);
    const Eigen::Vector3d anchor = middle_of(pose);
    const RigidTransform move = sights.size() == 1
                                    ? move_by_width(sights[0], borders[0], anchor, options.border_inset_mm)
                                    : move_by_planes(sights, borders, anchor);
    pose.world_from_model = move * pose.world_from_model;
    ++pose.evaluations;
    const double shift_mm = (middle_of(pose) - anchor).norm();
    if (shift_mm < 1e-2 && marrow::geodesic_angle_rad(move.rotation, Eigen::Matrix3d::Identity()) < 1e-4) break;
  }
  pose.warnings =
      doubts(sights, borders_of(model, pose, sights, options.tolerance_mm), middle_of(pose), options.border_inset_mm);
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
      .option("max_iterations", &Options::max_iterations,
              "largest number of iterations; each measures the model's axis again", marrow::at_least(1),
              marrow::at_most(100))
      .option("tolerance_mm", &Options::tolerance_mm,
              "largest distance, in mm at the bone, of a silhouette point from the model's border line",
              marrow::at_least(0.01))
      .option("border_inset_mm", &Options::border_inset_mm,
              "distance of a round bone's edge inside its outline, in mm at the bone, because attenuation begins "
              "gradually; it matters if a single view gives the depth from the width");
}
