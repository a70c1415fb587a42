// SPDX-License-Identifier: Apache-2.0
// A camera from points whose places in the world are known and that are marked in the image: a direct linear
// transformation (Hartley and Zisserman 2004, 7.1) gives a start, and Levenberg-Marquardt steps minimise the
// reprojection error (7.2). The curvature there and the size of the residuals give the deviations.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <marrow/domain/decompositions.hpp>
#include <marrow/plugin.hpp>

#include "marrow/base/names.hpp"
#include "marrow/camera/points_file.hpp"
#include "marrow/toolbox/calibration/plausibility.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace {

using namespace marrow;
using calibration::SeenPoints;

struct Options {
  std::filesystem::path points;
  std::string view;
  int width_px = 512, height_px = 512;
  std::string unknown = "all";
};

struct Found {
  Camera camera;
  Metrics metrics;
};

using Parameters = Eigen::VectorXd;  // the pose's motion (rotation vector, translation), then log focal length, centre

/// Camera after a change of its parameters: a small turn and shift of the camera's frame, then the inner parameters.
Camera changed(Camera camera, const Parameters& by) {
  const Eigen::Matrix3d turn = rotation_from_vector(by.head<3>());
  camera.camera_from_world.rotation = turn * camera.camera_from_world.rotation;
  camera.camera_from_world.translation_mm = turn * camera.camera_from_world.translation_mm + by.segment<3>(3);
  if (by.size() > 6) camera.intrinsics.topLeftCorner<2, 2>() *= std::exp(by[6]);
  if (by.size() > 7) camera.intrinsics.topRightCorner<2, 1>() += by.segment<2>(7);
  return camera;
}

Eigen::VectorXd residuals(const Camera& camera, const SeenPoints& points) {
  Eigen::VectorXd residuals(2 * Eigen::Index(points.pixels.size()));
  for (std::size_t i = 0; i < points.pixels.size(); ++i)
    residuals.segment<2>(2 * Eigen::Index(i)) = project(camera, points.world_mm[i]) - points.pixels[i];
  return residuals;
}

/// By central differences, with steps of about the same effect on the pixels.
Eigen::MatrixXd jacobian(const Camera& camera, const SeenPoints& points, Eigen::Index count) {
  const double depth_mm = camera.camera_from_world.translation_mm.norm();
  Parameters steps(9);
  steps << 1e-5, 1e-5, 1e-5, Eigen::Vector3d::Constant(1e-5 * depth_mm), 1e-5, 1e-2, 1e-2;
  Eigen::MatrixXd result(2 * Eigen::Index(points.pixels.size()), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Parameters step = Parameters::Unit(count, k) * steps[k];
    result.col(k) =
        (residuals(changed(camera, step), points) - residuals(changed(camera, -step), points)) / (2 * steps[k]);
  }
  return result;
}

/// The spread of the points along their three principal axes, in mm, ascending.
Eigen::Vector3d spreads_mm(const SeenPoints& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& point : points.world_mm) mean += point / double(points.world_mm.size());
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& point : points.world_mm)
    sum += (point - mean) * (point - mean).transpose() / double(points.world_mm.size());
  return eigen_of_symmetric<3>(sum).values.cwiseMax(0).cwiseSqrt();
}

/// The projection by the direct linear transformation, with points and pixels normalised.
files::Projection direct_projection(const SeenPoints& points) {
  const std::size_t n = points.world_mm.size();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < n; ++i) mean += points.world_mm[i] / double(n), centre += points.pixels[i] / double(n);
  double size_mm = 0, size_px = 0;
  for (std::size_t i = 0; i < n; ++i) {
    size_mm += (points.world_mm[i] - mean).norm() / double(n) / std::sqrt(3.0);
    size_px += (points.pixels[i] - centre).norm() / double(n) / std::sqrt(2.0);
  }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(2 * Eigen::Index(n), 12);
  for (std::size_t i = 0; i < n; ++i) {
    const Eigen::RowVector4d x = ((points.world_mm[i] - mean) / size_mm).homogeneous().transpose();
    const Eigen::Vector2d seen = (points.pixels[i] - centre) / size_px;
    const Eigen::Index row = 2 * Eigen::Index(i);
    a.block<1, 4>(row, 0) = a.block<1, 4>(row + 1, 4) = x;
    a.block<1, 4>(row, 8) = -seen.x() * x;
    a.block<1, 4>(row + 1, 8) = -seen.y() * x;
  }
  const Eigen::Matrix<double, 12, 1> found = eigen_of_symmetric<Eigen::Dynamic>(a.transpose() * a).vectors.col(0);
  files::Projection p = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(found.data());
  Eigen::Matrix3d pixels = Eigen::Matrix3d::Identity();
  pixels.topLeftCorner<2, 2>() *= size_px;
  pixels.topRightCorner<2, 1>() = centre;
  Eigen::Matrix4d world = Eigen::Matrix4d::Identity();
  world.topLeftCorner<3, 3>() /= size_mm;
  world.topRightCorner<3, 1>() = -mean / size_mm;
  p = pixels * p * world;
  double front = 0;  // the points lie in front of the source
  for (const Eigen::Vector3d& point : points.world_mm) front += p.row(2) * point.homogeneous();
  return front < 0 ? files::Projection(-p) : p;
}

Camera start_of(const SeenPoints& points, const Eigen::Vector2i& size_px) {
  const auto found = files::camera_of_projection(direct_projection(points), size_px);
  if (!found) throw Error("the points do not determine a camera; mark points that are spread over the image and depth");
  if (found->is_mirrored)
    throw Error(
        "only the mirrored image shows the points like this: it is seen from the detector, or an axis of the points "
        "runs the other way; mirror the image, or change the sign");
  Camera camera = found->camera;
  // Pixels of one size, without a skew: the two focal lengths differ by noise alone.
  const double focal_px = std::sqrt(camera.intrinsics(0, 0) * camera.intrinsics(1, 1));
  camera.intrinsics(0, 0) = camera.intrinsics(1, 1) = focal_px;
  camera.intrinsics(0, 1) = 0;
  return camera;
}

/// Goes down to the least reprojection error.
Camera fitted(Camera camera, const SeenPoints& points, Eigen::Index count) {
  double damping = 1e-3;
  for (int round = 0; round < 200; ++round) {
    const Eigen::VectorXd here = residuals(camera, points);
    const Eigen::MatrixXd j = jacobian(camera, points, count);
    const Eigen::MatrixXd curvature = j.transpose() * j;
    bool better = false;
    for (; damping < 1e10 && !better; damping *= 10) {
      Eigen::MatrixXd damped = curvature;
      damped.diagonal() *= 1 + damping;
      const Camera next = changed(camera, solve_symmetric<Eigen::Dynamic>(damped, -j.transpose() * here));
      const Eigen::VectorXd there = residuals(next, points);
      if (!there.allFinite() || there.squaredNorm() >= here.squaredNorm()) continue;
      better = true;
      camera = next;
      damping *= 0.01;
      if (here.squaredNorm() - there.squaredNorm() < 1e-12 * here.squaredNorm() + 1e-20) return camera;
    }
    if (!better) break;
    damping = std::max(damping, 1e-12);
  }
  return camera;
}

SeenPoints points_in(const Options& options, std::string view) {
  SeenPoints points;
  std::vector<std::string> names;
  for (const files::KnownPoint& point : files::read_points_file(options.points)) {
    if (view.empty() && !point.seen_px.empty()) view = point.seen_px.begin()->first;
    for (const auto& [name, pixel] : point.seen_px)
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    const auto seen = point.seen_px.find(view);
    if (!point.world_mm || seen == point.seen_px.end()) continue;
    points.world_mm.push_back(*point.world_mm);
    points.pixels.push_back(seen->second);
  }
  if (std::find(names.begin(), names.end(), view) == names.end())
    throw Error("view: no point is seen in '" + view + "'; " + suggestion(view, names));
  return points;
}

void check_points(const SeenPoints& points, Eigen::Index count) {
  const std::size_t least = count == 6 ? 4 : 6;
  if (points.pixels.size() < least)
    throw Error(
        formatted("{} points have a place in the world (at_mm) and are seen in this view; at least {} are needed"
                  "{}",
                  points.pixels.size(), least,
                  count == 6 ? "" : ", or 4 if the camera's inner parameters are known (unknown: pose)"));
  const Eigen::Vector3d spread = spreads_mm(points);
  if (spread[1] < 0.01 * spread[2])
    throw Error("the points lie nearly on a line, so they do not determine a camera; mark points beside it");
  if (count > 6 && spread[0] < 0.03 * spread[2])
    throw Error(
        "the points lie nearly in one plane, so one image does not tell the focal length from the distance; mark "
        "points off the plane, or give a camera whose inner parameters are known (unknown: pose)");
}

Metrics metrics_of(const Camera& camera, const SeenPoints& points, Eigen::Index count) {
  const Eigen::VectorXd left = residuals(camera, points);
  const Eigen::MatrixXd j = jacobian(camera, points, count);
  const double freedom = double(left.size() - count), variance = freedom > 0 ? left.squaredNorm() / freedom : 0;
  const Eigen::VectorXd deviation =
      (variance * (j.transpose() * j).ldlt().solve(Eigen::MatrixXd::Identity(count, count)))
          .diagonal()
          .cwiseMax(0)
          .cwiseSqrt();
  double worst = 0;
  for (Eigen::Index i = 0; i < left.size(); i += 2) worst = std::max(worst, left.segment<2>(i).norm());
  Metrics metrics;
  metrics.items = {{"points", double(points.pixels.size()), ""},
                   {"error", std::sqrt(left.squaredNorm() / double(points.pixels.size())), "px"},
                   {"worst", worst, "px"}};
  const char* axes[] = {"u", "v", "depth"};
  for (int k = 0; k < 3; ++k)
    metrics.items.push_back({formatted("predicted_rotation_{}_deg", axes[k]), degrees(deviation[k]), "deg"});
  for (int k = 0; k < 3; ++k)
    metrics.items.push_back({formatted("predicted_shift_{}_mm", axes[k]), deviation[3 + k], "mm"});
  if (count > 6) metrics.items.push_back({"predicted_focal_length_px", deviation[6] * camera.intrinsics(0, 0), "px"});
  if (count > 7) {
    metrics.items.push_back({"predicted_centre_u_px", deviation[7], "px"});
    metrics.items.push_back({"predicted_centre_v_px", deviation[8], "px"});
  }
  return metrics;
}

Found points(const Camera* known, const Options& options, Context& context) {
  const Eigen::Index count = options.unknown == "pose" ? 6 : options.unknown == "focal_length" ? 7 : 9;
  const SeenPoints points = points_in(options, options.view);
  check_points(points, count);
  const int width = known ? known->width_px : options.width_px, height = known ? known->height_px : options.height_px;
  if (count == 6 && !known)
    throw Error("with unknown: pose the inner parameters must be known; wire a camera that has them");
  Camera camera;
  if (known) {
    check_camera(*known, "camera");
    camera = *known;
    if (const auto refit = calibration::pose_of_points(camera, points)) camera.camera_from_world = *refit;
  }
  if (count > 6) {
    const Camera start = start_of(points, {width, height});
    if (!known) camera = start;
    if (!known && count == 7) camera.intrinsics.topRightCorner<2, 1>() << 0.5 * (width - 1), 0.5 * (height - 1);
    if (known) {
      camera.camera_from_world = start.camera_from_world;
      if (count == 9) camera.intrinsics = start.intrinsics;
    }
  }
  Found found;
  found.camera = fitted(camera, points, count);
  found.camera.camera_from_world.rotation = nearest_rotation(found.camera.camera_from_world.rotation);
  check_camera(found.camera, "the camera that fits the points");
  found.metrics = metrics_of(found.camera, points, count);
  if (count > 6) {
    const double focal = found.camera.intrinsics(0, 0);
    for (const Metric& metric : found.metrics.items)
      if (metric.name == "predicted_focal_length_px" && metric.value > 0.02 * focal)
        context.warn(
            formatted("the points determine the focal length of {:.0f} px to {:.0f} px only; points farther "
                      "apart in depth, or more of them, determine it better",
                      focal, metric.value));
  }
  return found;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.points", points)
      .summary(
          "A camera from points with known places in the world that are marked in the image, with its deviations "
          "(direct linear transformation, then least reprojection error)")
      .in("camera", "camera whose known parameters are kept, and whose image size counts")
      .out("camera", &Found::camera, "the camera")
      .out("metrics", &Found::metrics,
           "reprojection errors, and standard deviations of the camera's parameters: about and along the axes of its "
           "image (u, v, depth), of the focal length and of the principal point")
      .figures({"points", "error", "worst", "predicted_rotation_u_deg", "predicted_rotation_v_deg",
                "predicted_rotation_depth_deg", "predicted_shift_u_mm", "predicted_shift_v_mm",
                "predicted_shift_depth_mm", "predicted_focal_length_px", "predicted_centre_u_px",
                "predicted_centre_v_px"})
      .option("known_points", &Options::points,
              "file with the points and the pixels where they are seen (docs/case.md)", required())
      .option("view", &Options::view, "name under which the file gives the pixels; empty: the first one")
      .option("width_px", &Options::width_px, "width of the image; not needed with a camera", at_least(1),
              at_most(65536))
      .option("height_px", &Options::height_px, "height of the image; not needed with a camera", at_least(1),
              at_most(65536))
      .option("unknown", &Options::unknown,
              "all: pose, focal length and principal point, of square pixels; focal_length: the principal point is "
              "the camera's or, without one, the middle of the image; pose: all inner parameters are the camera's",
              one_of({"all", "focal_length", "pose"}));
}
