// SPDX-License-Identifier: Apache-2.0
// Reads the grid with which XMALab corrects a camera's distortion, or its parameters, or both.
#include <marrow/plugin.hpp>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "marrow/toolbox/exchange/xmalab_grid.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace {

using namespace marrow;

struct Options : exchange::XmalabGridFiles {
  std::filesystem::path camera, parameters;
};

/// XMALab takes a grid out of an image first, and then the distortion by these parameters. Gives points whose ideal
/// places are without both: those of `grid`, or, without one, a regular lattice over the image. Points for which the
/// parameters cannot be inverted are not used.
distortion::PlatePoints without_parameters(const std::optional<distortion::PlatePoints>& grid,
                                           const std::vector<double>& parameters, const Camera& camera) {
  distortion::PlatePoints points;
  if (grid) {
    points = *grid;
  } else {
    points.width_px = camera.width_px;
    points.height_px = camera.height_px;
    constexpr int kSteps = 40;
    for (int row = 0; row <= kSteps; ++row)
      for (int column = 0; column <= kSteps; ++column) {
        const Eigen::Vector2d at(column * (camera.width_px - 1.0) / kSteps, row * (camera.height_px - 1.0) / kSteps);
        points.add(at, at);
      }
  }
  const auto& k = camera.intrinsics;
  const cv::Matx33d matrix(k(0, 0), k(0, 1), k(0, 2), 0, k(1, 1), k(1, 2), 0, 0, 1);
  std::vector<cv::Point2d> seen, ideal, again;
  for (const Eigen::Vector2d& at : points.ideal_px) seen.emplace_back(at.x(), at.y());
  cv::undistortPoints(seen, ideal, matrix, parameters, cv::noArray(), matrix,
                      {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 100, 1e-10});
  std::vector<cv::Point3d> rays;
  for (const cv::Point2d& at : ideal)
    rays.emplace_back((at.x - k(0, 2) - k(0, 1) * (at.y - k(1, 2)) / k(1, 1)) / k(0, 0), (at.y - k(1, 2)) / k(1, 1), 1);
  cv::projectPoints(rays, cv::Vec3d(), cv::Vec3d(), matrix, parameters, again);
  for (std::size_t i = 0; i < ideal.size(); ++i) {
    points.ideal_px[i] = {ideal[i].x, ideal[i].y};
    if (!(cv::norm(again[i] - seen[i]) < 0.01)) points.used[i] = 0;
  }
  return points;
}

distortion::PlatePoints xmalab_grid(const Options& options) {
  if (options.distorted.empty() != options.references.empty())
    throw Error("read.xmalab_grid: 'distorted' and 'references' belong together; give both files of the grid or none");
  const Camera camera = files::read_camera_file(options.camera).camera;
  std::optional<distortion::PlatePoints> grid;
  if (!options.distorted.empty()) grid = exchange::read_xmalab_grid(options, camera.width_px, camera.height_px);
  if (options.parameters.empty()) return *grid;
  return without_parameters(grid, exchange::read_xmalab_parameters(options.parameters), camera);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("read.xmalab_grid", xmalab_grid)
      .summary("Reads XMALab's undistortion grid or undistortion parameters, for camera.distortion_points")
      .out("points", "where each point was seen, and where XMALab's corrected image shows it")
      .option("camera", &Options::camera, "camera file of XMALab: its image size, and its matrix for the parameters",
              required())
      .option("distorted", &Options::distorted, "NAME_GridPointsDistorted.csv of the project's folder data")
      .option("references", &Options::references, "NAME_GridPointsReferences.csv")
      .option("inlier", &Options::inlier, "NAME_GridPointsInlier.csv; without it, all points are used")
      .option("parameters", &Options::parameters,
              "CAMERA_UndistortionParameter.csv, if the camera was optimised with a distortion model")
      .relation(at_least_one({"distorted", "parameters"}));
}
