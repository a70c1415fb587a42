// SPDX-License-Identifier: Apache-2.0
// Calibration of a camera for visible light from photographs of a chessboard (Zhang 2000, by OpenCV), and the place of
// the camera when it sees the board at a known place.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <opencv2/calib3d.hpp>

#include "marrow/toolbox/calibration/calibrate.hpp"
#include "marrow/toolbox/calibration/chessboard.hpp"
#include "marrow/toolbox/calibration/plausibility.hpp"

namespace {

using namespace marrow;

struct Options : calibration::Chessboard, calibration::ChessboardPlace {
  int radial_terms = 2;
};

struct Result {
  Calibration calibration;
  List<Camera> cameras;
  Metrics metrics;
};

/// Corners in one photograph.
struct Seen {
  std::string name;
  std::vector<Eigen::Vector2d> pixels;
};

std::string size_of(const cv::Mat& pixels) { return formatted("{} x {} pixels", pixels.cols, pixels.rows); }

/// What OpenCV's calibration finds. The last three terms of its distortion are not used or not always.
struct Fit {
  cv::Mat1d matrix = cv::Mat1d::eye(3, 3), distortion = cv::Mat1d::zeros(1, 5), residuals;
  std::vector<cv::Mat> rotations, translations;
  double residual_px = 0;
};

Fit fitted(const std::vector<Seen>& seen, const cv::Size& size, const Options& options) {
  std::vector<cv::Point3f> board;
  for (const Eigen::Vector3d& corner : calibration::corners_mm(options))
    board.emplace_back(float(corner.x()), float(corner.y()), 0.0f);
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const Seen& one : seen) {
    pixels.emplace_back();
    for (const Eigen::Vector2d& corner : one.pixels) pixels.back().emplace_back(float(corner.x()), float(corner.y()));
  }
  int flags = cv::CALIB_ZERO_TANGENT_DIST;
  if (options.radial_terms < 3) flags |= cv::CALIB_FIX_K3;
  if (options.radial_terms < 2) flags |= cv::CALIB_FIX_K2;
  if (options.radial_terms < 1) flags |= cv::CALIB_FIX_K1;
  Fit fit;
  const double root_mean_square =
      cv::calibrateCamera(std::vector<std::vector<cv::Point3f>>(seen.size(), board), pixels, size, fit.matrix,
                          fit.distortion, fit.rotations, fit.translations, cv::noArray(), cv::noArray(), fit.residuals,
                          flags, {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 100, 1e-12});
  fit.residual_px = root_mean_square / std::sqrt(2.0);  // OpenCV gives that of the length; this is that of a coordinate
  return fit;
}

RigidTransform camera_from_board(const Fit& fit, std::size_t i) {
  const cv::Mat1d turn = fit.rotations[i], shift = fit.translations[i];
  return {"camera", "board", rotation_from_vector({turn(0), turn(1), turn(2)}), {shift(0), shift(1), shift(2)}};
}

/// OpenCV's own deviations leave out directions that it takes for singular. For boards that were never tilted, it gave
/// a focal length that was 3 times too long, with a deviation of half a pixel.
void add_deviations(const std::vector<Seen>& seen, const Fit& fit, const Options& options, Calibration& device) {
  std::vector<calibration::ViewPoints> views;
  calibration::CalibrationResult result{device, {}};
  for (std::size_t i = 0; i < seen.size(); ++i) {
    views.push_back({seen[i].name, calibration::corners_mm(options), seen[i].pixels, {}});
    result.views.emplace_back().camera_from_world = camera_from_board(fit, i);
  }
  calibration::add_deviations(views, {options.radial_terms, false, true}, result);
  device.focal_deviation_px = result.calibration.focal_deviation_px;
  device.principal_deviation_px = result.calibration.principal_deviation_px;
  device.distortion_deviation = result.calibration.distortion_deviation;
}

Calibration calibration_of(const std::vector<Seen>& seen, const Fit& fit, const cv::Size& size,
                           const Options& options) {
  Calibration result;
  result.width_px = size.width;
  result.height_px = size.height;
  result.intrinsics << fit.matrix(0, 0), 0, fit.matrix(0, 2), 0, fit.matrix(1, 1), fit.matrix(1, 2), 0, 0, 1;
  result.distortion.k = {fit.distortion(0, 0), fit.distortion(0, 1), fit.distortion(0, 4)};
  result.residual_px = fit.residual_px;
  add_deviations(seen, fit, options, result);
  return result;
}

Camera camera_of(const Fit& fit, std::size_t i, const Calibration& device, const RigidTransform& world_from_board) {
  return {device.width_px, device.height_px, device.intrinsics, camera_from_board(fit, i) * inverse(world_from_board)};
}

Metrics report_of(const Fit& fit, const Calibration& c, std::size_t photographs) {
  double worst = 0;
  for (const double residual : fit.residuals) worst = std::max(worst, residual);
  Metrics report{
      {{"photographs", double(photographs), ""}, {"residual", c.residual_px, "px"}, {"worst_photograph", worst, "px"}}};
  const char* axes[] = {"u", "v"};
  for (int i : {0, 1}) {
    report.items.push_back({std::string("focal_") + axes[i], c.intrinsics(i, i), "px"});
    report.items.push_back({std::string("focal_") + axes[i] + "_deviation", c.focal_deviation_px[i], "px"});
    report.items.push_back({std::string("principal_") + axes[i], c.intrinsics(i, 2), "px"});
    report.items.push_back({std::string("principal_") + axes[i] + "_deviation", c.principal_deviation_px[i], "px"});
  }
  for (std::size_t i = 0; i < 3; ++i) report.items.push_back({formatted("k{}", i + 1), c.distortion.k[i], ""});
  return report;
}

Result chessboard(const List<Picture>& boards, const List<Picture>* placed, const Options& options, Context& context) {
  calibration::check_chessboard(options, "camera.chessboard");
  const std::string board = formatted("{} x {} inner corners", options.columns, options.rows);
  std::vector<Seen> seen;
  cv::Size size;
  const auto look_at = [&](const std::string& name, const Picture& photograph) {
    context.check_cancelled();
    if (photograph.pixels.empty() || photograph.pixels.type() != CV_8UC3)
      throw Error("photograph '" + name + "' is not a colour picture of 8 bits");
    if (size.area() > 0 && photograph.pixels.size() != size)
      throw Error(formatted("photograph '{}' has {}, those before it {} x {}; one calibration is for one size", name,
                            size_of(photograph.pixels), size.width, size.height));
    size = photograph.pixels.size();
    seen.push_back({name, calibration::find_corners(photograph, options)});
    return !seen.back().pixels.empty();
  };
  for (std::size_t i = 0; i < boards.size(); ++i)
    if (!look_at(boards.name(i), boards[i])) {
      context.warn("photograph '" + boards.name(i) + "' does not show a whole chessboard with " + board +
                   "; it is left out");
      seen.pop_back();
    }
  if (seen.size() < 3)
    throw Error(
        formatted("{} of {} photographs show a chessboard with {}; at least 3 are needed, and 10 are better, with the "
                  "board tilted differently in each",
                  seen.size(), boards.size(), board));
  const std::size_t first_placed = seen.size();
  for (std::size_t i = 0; placed && i < placed->size(); ++i)
    if (!look_at(placed->name(i), (*placed)[i]))
      throw Error("photograph '" + placed->name(i) + "' does not show the whole chessboard with " + board +
                  " at its known place, so the camera's place is not known");
  const Fit fit = fitted(seen, size, options);
  Result result;
  result.calibration = calibration_of(seen, fit, size, options);
  check_distortion(result.calibration.intrinsics, result.calibration.distortion, size.width, size.height,
                   "the calibration");
  if (const std::string text = calibration::doubtful_focal_length(result.calibration, "the photographs"); !text.empty())
    context.warn(text);
  result.metrics = report_of(fit, result.calibration, seen.size());
  const RigidTransform world_from_board = calibration::world_from_board(options, options);
  for (std::size_t i = first_placed; i < seen.size(); ++i)
    result.cameras.add(seen[i].name, camera_of(fit, i, result.calibration, world_from_board));
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.chessboard", chessboard)
      .summary(
          "Calibration from photographs of a chessboard (Zhang 2000), and the camera's place where it sees the board "
          "at "
          "a known place")
      .in("boards", "the board in at least 3 ways, not corrected for distortion", over("photograph"))
      .in("placed", "the board at its known place, one photograph from each place of the camera", over("view"))
      .out("calibration", &Result::calibration, "camera matrix and distortion, with standard deviations")
      .out("camera", &Result::cameras, "camera of each photograph in 'placed', without distortion", over("view"))
      .out("metrics", &Result::metrics,
           "the same as figures, with the residual of a coordinate and the root mean square distance in the worst "
           "photograph")
      .figures({"photographs", "residual", "worst_photograph", "focal_u", "focal_u_deviation", "principal_u",
                "principal_u_deviation", "focal_v", "focal_v_deviation", "principal_v", "principal_v_deviation", "k1",
                "k2", "k3"})
      .option("columns", &Options::columns, "number of inner corners in a row", at_least(3), at_most(100))
      .option("rows", &Options::rows, "number of inner corners in a column; one even, one odd", at_least(3),
              at_most(100))
      .option("square_mm", &Options::square_mm, "side of a square", at_least(0.1))
      .option("middle_mm", &Options::middle_mm, "the known place: the middle of the inner corners in the world")
      .option("turns_deg", &Options::turns_deg,
              "the known place: turns about x, then y, then z, from a board in the plane z = 0 that is seen from below")
      .option("radial_terms", &Options::radial_terms, "number of terms of the radial distortion (r^2, r^4, r^6)",
              at_least(0), at_most(3));
}
