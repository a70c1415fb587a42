// SPDX-License-Identifier: Apache-2.0
// Checks whether the cameras are right. It draws a known object into the images, and compares the places where its
// points are seen with their projections.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <marrow/plugin.hpp>

#include <marrow/domain/decompositions.hpp>
#include "marrow/camera/points_file.hpp"
#include "marrow/toolbox/calibration/plausibility.hpp"
#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow;
using calibration::SeenPoints;
using files::KnownPoint;

struct Options {
  std::filesystem::path known_points;
  double warn_above_px = 2;
  double source_to_detector_mm = 0;
  double pixel_mm = 0;
  double detector_mm = 0;
  double residual_scale = 20;
  int size_px = 1000;
};

struct Checked {
  Metrics metrics;
  List<Picture> pictures;
};

/// Triangulates a point from all views that show it: the position with the least sum of squared distances from the
/// rays. Nothing if fewer than two views show it, or if their rays are nearly parallel.
std::optional<Eigen::Vector3d> triangulated(const KnownPoint& point, const List<View>& views) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  for (const View& view : views) {
    const auto seen = point.seen_px.find(view.name);
    if (seen == point.seen_px.end()) continue;
    const Eigen::Vector3d direction = ray_direction(view.camera, seen->second);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    normal += across;
    right += across * source_position_mm(view.camera);
    ++count;
  }
  if (count < 2 || normal.determinant() < 1e-6) return std::nullopt;
  return solve_symmetric(normal, right);
}

void check_names(const std::vector<KnownPoint>& points, const List<View>& views) {
  for (const KnownPoint& point : points)
    for (const auto& [name, at] : point.seen_px)
      if (!views.find(name)) {
        std::string known;
        for (const std::string& other : views.names()) known += (known.empty() ? "'" : ", '") + other + "'";
        throw Error("point '" + point.name + "' is seen in '" + name +
                    "', but there is no view of that name; there are " + known);
      }
}

/// The points that a view shows, with their pixels. `known`: only points with a given position. `all`: triangulated
/// points too.
struct InView {
  SeenPoints known, all;
};

InView points_in(const View& view, const std::vector<KnownPoint>& points, const List<View>& views) {
  InView in_view;
  for (const KnownPoint& point : points) {
    const auto seen = point.seen_px.find(view.name);
    if (seen == point.seen_px.end()) continue;
    const auto place = point.world_mm ? point.world_mm : triangulated(point, views);
    if (!place) continue;
    for (SeenPoints* list : {&in_view.known, &in_view.all}) {
      if (list == &in_view.known && !point.world_mm) continue;
      list->world_mm.push_back(*place);
      list->pixels.push_back(seen->second);
    }
  }
  return in_view;
}

/// Edges between triangles that face the source and triangles that do not, and the edges of holes.
std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> outline_edges(const Mesh& mesh, const Camera& camera) {
  const Eigen::Vector3d source = source_position_mm(camera);
  // Bits of an edge: 1 = it has a triangle seen from the front, 2 = seen from behind, 4 = two or more triangles.
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[triangle[0]], &b = mesh.vertices_mm[triangle[1]],
                          &c = mesh.vertices_mm[triangle[2]];
    const int side = (b - a).cross(c - a).dot(source - a) > 0 ? 1 : 2;
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax(triangle[std::size_t(k)], triangle[std::size_t((k + 1) % 3)]);
      int& mark = sides[{low, high}];
      mark |= mark ? side | 4 : side;
    }
  }
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> edges;
  for (const auto& [edge, mark] : sides)
    if (mark == 7 || mark < 4) edges.emplace_back(mesh.vertices_mm[edge.first], mesh.vertices_mm[edge.second]);
  return edges;
}

Picture draw(const View& view, const SeenPoints& points, const Mesh* mesh, const std::string& verdict,
             const Options& options) {
  using namespace draw;
  Panel panel = make_panel(view, whole_image(view), options.size_px, Contrast::local);
  std::vector<LegendItem> legend;
  if (mesh) {
    for (const auto& [from, to] : outline_edges(*mesh, view.camera)) {
      const Eigen::Vector2d a = project(view.camera, from), b = project(view.camera, to);
      if (a.allFinite() && b.allFinite())
        draw_line(panel.pixels, panel.at(a.x(), a.y()), panel.at(b.x(), b.y()), kSkyBlue);
    }
    legend.push_back({"object", kSkyBlue});
  }
  const std::string scale = formatted("difference x {:g}", options.residual_scale);
  for (std::size_t i = 0; i < points.pixels.size(); ++i) {
    const Eigen::Vector2d seen = points.pixels[i], expected = project(view.camera, points.world_mm[i]);
    const cv::Point2d at = panel.at(seen.x(), seen.y());
    draw_dot(panel.pixels, at, 3, kGreen);
    if (!expected.allFinite()) continue;
    const Eigen::Vector2d end = seen + options.residual_scale * (expected - seen);
    draw_line(panel.pixels, at, panel.at(end.x(), end.y()), kVermilion, 2);
    draw_dot(panel.pixels, panel.at(expected.x(), expected.y()), 1.5, kYellow);
  }
  if (!points.pixels.empty()) {
    legend.push_back({"seen", kGreen});
    legend.push_back({"expected", kYellow});
    legend.push_back({scale, kVermilion});
  }
  draw_title(panel, view.name + verdict);
  return {with_legend(panel.pixels, legend)};
}

/// The warnings about one view, the most probable first. `mistake`: the sentence that explains its points, if any.
std::vector<std::string> warnings_of(const View& view, const InView& points, const Mesh* mesh, const Options& options,
                                     double error, const std::optional<std::string>& mistake) {
  std::vector<Eigen::Vector3d> object = points.known.world_mm;
  if (mesh) object.insert(object.end(), mesh->vertices_mm.begin(), mesh->vertices_mm.end());
  std::vector<std::string> warnings;
  if (mistake) warnings.push_back(*mistake);
  for (const std::string& sentence : calibration::implausible_numbers(
           view.camera, {options.source_to_detector_mm, options.pixel_mm, options.detector_mm}, object))
    warnings.push_back(sentence);
  if (mistake || points.all.pixels.empty() || error <= options.warn_above_px) return warnings;
  const auto refit = calibration::refit_pose(view.camera, points.known);
  if (refit && refit->error_px < error / 3)
    warnings.push_back(
        formatted("the points are {:.3g} px off, but only {:.3g} px if the camera is turned by {:.3g} degrees and "
                  "moved by {:.3g} mm: its inner parameters are right, its pose is not, or the object has moved",
                  error, refit->error_px, refit->turn_deg, refit->shift_mm));
  else
    warnings.push_back(formatted("the points are {:.3g} px off{}", error,
                                 refit
                                     ? formatted(", and still {:.3g} px with the best pose: focal length, principal "
                                                 "point, distortion or the points themselves are wrong",
                                                 refit->error_px)
                                     : formatted(", more than the {:.3g} px of warn_above_px", options.warn_above_px)));
  return warnings;
}

void add_metrics(const View& view, const InView& points, double error, Metrics& metrics) {
  const std::string name = view.name + ".";
  double worst = 0, millimetres = 0;
  for (std::size_t i = 0; i < points.all.pixels.size(); ++i) {
    const Eigen::Vector2d off = project(view.camera, points.all.world_mm[i]) - points.all.pixels[i];
    worst = std::max(worst, off.norm());
    millimetres += offset_at_mm(view.camera, points.all.world_mm[i], off).norm() / double(points.all.pixels.size());
  }
  metrics.items.push_back({name + "points", double(points.all.pixels.size()), ""});
  if (points.all.pixels.empty()) return;
  metrics.items.push_back({name + "error", error, "px"});
  metrics.items.push_back({name + "worst", worst, "px"});
  metrics.items.push_back({name + "mean_at_object", millimetres, "mm"});
  if (const auto refit = calibration::refit_pose(view.camera, points.known))
    metrics.items.push_back({name + "error_with_free_pose", refit->error_px, "px"});
}

/// The distance of a point seen in one view from the line on which another view says that it lies: the image of the ray
/// through the other view's pixel.
double epipolar_distance_px(const Camera& other, const Eigen::Vector2d& in_other, const Camera& camera,
                            const Eigen::Vector2d& pixel) {
  const auto shown = [&](const Eigen::Vector3d& world) {
    return Eigen::Vector3d(camera.intrinsics * (camera.camera_from_world * world));
  };
  const Eigen::Vector3d source = source_position_mm(other);
  Eigen::Vector3d line = shown(source).cross(shown(source + 1000 * ray_direction(other, in_other)));
  line /= line.head<2>().norm();
  return std::abs(line.dot(pixel.homogeneous()));
}

/// For each pair of views the root mean square epipolar distance of the points that both show, in both images. It needs
/// no places in the world, so it tells how well the cameras agree, not whether both are off together.
void add_epipolar_metrics(const List<View>& views, const std::vector<KnownPoint>& points, Metrics& metrics) {
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const Camera &a = views[k].camera, &b = views[i].camera;
      double squares = 0, count = 0;
      for (const KnownPoint& point : points) {
        const auto in_a = point.seen_px.find(views[k].name), in_b = point.seen_px.find(views[i].name);
        if (in_a == point.seen_px.end() || in_b == point.seen_px.end()) continue;
        squares += std::pow(epipolar_distance_px(a, in_a->second, b, in_b->second), 2) +
                   std::pow(epipolar_distance_px(b, in_b->second, a, in_a->second), 2);
        count += 2;
      }
      if (count > 0)
        metrics.items.push_back({views[k].name + "-" + views[i].name + ".epipolar", std::sqrt(squares / count), "px"});
    }
}

/// Two views along nearly the same direction do not determine the depth of a point.
void check_directions(const List<View>& views, Context& context, int& warnings) {
  for (std::size_t i = 0; i < views.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const auto axis = [&](std::size_t n) {
        return Eigen::Vector3d(views[n].camera.camera_from_world.rotation.row(2));
      };
      const double angle = degrees(std::acos(std::min(1.0, std::abs(axis(i).dot(axis(k))))));
      if (angle > 10) continue;
      context.warn(formatted(
          "views '{}' and '{}' look along nearly the same line ({:.3g} degrees apart); is one camera given twice?",
          views.name(k), views.name(i), angle));
      ++warnings;
    }
}

Checked check(const List<View>& views, const Mesh* mesh, const Options& options, Context& context) {
  std::vector<KnownPoint> points;
  if (!options.known_points.empty()) points = files::read_points_file(options.known_points);
  check_names(points, views);
  if (mesh) check_mesh(*mesh, "camera.check: mesh");
  Checked checked;
  int warnings = 0;
  double squares = 0, count = 0;
  std::vector<InView> in_views;
  std::vector<Camera> cameras;
  std::vector<SeenPoints> known;
  for (const View& view : views) {
    check_view(view);
    in_views.push_back(points_in(view, points, views));
    cameras.push_back(view.camera);
    known.push_back(in_views.back().known);
  }
  const auto mistakes = calibration::explanations(cameras, known);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& view = views[i];
    const InView& seen = in_views[i];
    const double error = calibration::reprojection_error_px(view.camera, seen.all);
    squares += error * error * double(seen.all.pixels.size());
    count += double(seen.all.pixels.size());
    add_metrics(view, seen, error, checked.metrics);
    const auto sentences = warnings_of(view, seen, mesh, options, error, mistakes[i]);
    for (const std::string& sentence : sentences) context.warn("view '" + view.name + "': " + sentence);
    warnings += int(sentences.size());
    const std::string verdict = seen.all.pixels.empty() ? "" : formatted(": {:.3g} px", error);
    checked.pictures.add(view.name,
                         draw(view, seen.all, mesh, verdict + (sentences.empty() ? "" : ", see warnings"), options));
  }
  add_epipolar_metrics(views, points, checked.metrics);
  check_directions(views, context, warnings);
  if (count > 0)
    checked.metrics.items.insert(checked.metrics.items.begin(), {"error", std::sqrt(squares / count), "px"});
  checked.metrics.items.push_back({"warnings", double(warnings), ""});
  return checked;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.check", check)
      .summary(
          "Draws a known object into the images, measures the reprojection error and explains in words what is wrong "
          "with a camera")
      .in("views", "images with the cameras to check", over("view"))
      .in("mesh", "surface of a known object in world coordinates; it is drawn into the images")
      .out("metrics", &Checked::metrics,
           "reprojection errors, the epipolar distances of points that two views show, and the number of warnings")
      .figures({"error", "warnings", "*.points", "*.error", "*.worst", "*.mean_at_object", "*.error_with_free_pose",
                "*.epipolar"})
      .out("picture", &Checked::pictures, "each image with the seen and the expected positions of the points",
           over("view"))
      .option("known_points", &Options::known_points,
              "file with points of a known object and the pixels where they are seen (YAML, docs/case.md)")
      .option("warn_above_px", &Options::warn_above_px, "a larger reprojection error gives a warning", at_least(0))
      .option("source_to_detector_mm", &Options::source_to_detector_mm,
              "known distance from source to detector, to compare with; 0: not known", at_least(0))
      .option("pixel_mm", &Options::pixel_mm, "known size of a pixel on the detector, to compare with; 0: not known",
              at_least(0))
      .option("detector_mm", &Options::detector_mm, "known longer side of the detector, to compare with; 0: not known",
              at_least(0))
      .option("residual_scale", &Options::residual_scale, "differences are drawn this many times longer", at_least(1),
              unit("1"))
      .option("size_px", &Options::size_px, "longer side of the pictures", at_least(100), at_most(4096));
}
