// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/calibration/calibrate.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/quantile.hpp"

namespace marrow::calibration {
namespace {

constexpr std::size_t kLeastPoints = 8;

/// The first two rows of [R|t] up to a common factor, from the radial alignment constraint: for any focal length,
/// distance and radial distortion, a point is seen in the direction (r_1 X + t_x, r_2 X + t_y) from the principal
/// point.
std::optional<Eigen::Matrix<double, 2, 4>> aligned_rows(const std::vector<Eigen::Vector4d>& points,
                                                        const std::vector<Eigen::Vector2d>& seen) {
  Eigen::MatrixXd system(points.size(), 8);
  for (std::size_t i = 0; i < points.size(); ++i) {
    system.block<1, 4>(Eigen::Index(i), 0) = seen[i].y() * points[i].transpose();
    system.block<1, 4>(Eigen::Index(i), 4) = -seen[i].x() * points[i].transpose();
  }
  // The normal equations are exact enough for a start. A singular value decomposition would take a minute to compile.
  const SymmetricEigen<8> least = eigen_of_symmetric<8>(system.transpose() * system);
  // Points in one plane leave more than one direction undetermined.
  if (least.values[1] < 1e-12 * least.values[7]) return std::nullopt;
  Eigen::Matrix<double, 2, 4> rows;
  rows << least.vectors.col(0).head<4>().transpose(), least.vectors.col(0).tail<4>().transpose();
  double agreement = 0;
  for (std::size_t i = 0; i < points.size(); ++i) agreement += seen[i].dot(rows * points[i]);
  return agreement < 0 ? -rows : rows;
}

}  // namespace

std::optional<ClosedForm> closed_form_camera(const ViewPoints& view, const Eigen::Vector2d& middle_px) {
  if (view.board_mm.size() < kLeastPoints) return std::nullopt;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const auto& point : view.board_mm) centre += point / double(view.board_mm.size());
  double size = 0;
  for (const auto& point : view.board_mm) size = std::max(size, (point - centre).norm());
  if (!(size > 0)) return std::nullopt;
  std::vector<Eigen::Vector4d> points;
  std::vector<Eigen::Vector2d> seen;
  for (std::size_t i = 0; i < view.board_mm.size(); ++i) {
    points.push_back(((view.board_mm[i] - centre) / size).homogeneous());
    seen.push_back(view.pixels[i] - middle_px);
  }
  auto rows = aligned_rows(points, seen);
  if (!rows) return std::nullopt;
  *rows /= 0.5 * (rows->row(0).head<3>().norm() + rows->row(1).head<3>().norm());
  Eigen::Matrix3d rotation;
  rotation.row(0) = rows->row(0).head<3>();
  rotation.row(1) = rows->row(1).head<3>();
  rotation.row(2) = rotation.row(0).cross(rotation.row(1));
  rotation = nearest_orthogonal(rotation);
  // f (r_1 X + t_x) = u (r_3 X + t_z), and the same for v: linear in f and t_z.
  Eigen::MatrixXd system(2 * points.size(), 2);
  Eigen::VectorXd right(2 * points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double depth = rotation.row(2).dot(points[i].head<3>());
    for (int k = 0; k < 2; ++k) {
      const Eigen::Index at = Eigen::Index(2 * i) + k;
      system.row(at) << rotation.row(k).dot(points[i].head<3>()) + (*rows)(k, 3), -seen[i][k];
      right[at] = seen[i][k] * depth;
    }
  }
  const Eigen::Vector2d solution = least_squares(system, right);
  if (!solution.allFinite() || solution[0] == 0) return std::nullopt;
  ClosedForm camera;
  camera.focal_px = std::abs(solution[0]);
  camera.is_mirrored = solution[0] < 0 && solution[1] < 0;  // the third row of R then has the wrong sign
  if (!camera.is_mirrored && (solution[0] < 0 || solution[1] < 0)) return std::nullopt;
  camera.camera_from_world.rotation = rotation;
  camera.camera_from_world.translation_mm =
      size * Eigen::Vector3d((*rows)(0, 3), (*rows)(1, 3), std::abs(solution[1])) - rotation * centre;
  return camera;
}

Eigen::Vector2d seen_at(const Calibration& calibration, const RigidTransform& camera_from_world,
                        const Eigen::Vector3d& board_mm) {
  const Eigen::Vector3d x = camera_from_world * board_mm;
  return distorted_pixel(calibration.intrinsics, calibration.distortion, (calibration.intrinsics * x).hnormalized());
}

namespace {

/// Derivatives of a point's pixel by f_u, f_v, u_0, v_0, k_1..k_3 and by a small rotation and translation of the
/// camera.
Eigen::Matrix<double, 2, 13> derivatives(const Calibration& calibration, const RigidTransform& pose,
                                         const Eigen::Vector3d& board_mm) {
  const Eigen::Vector3d turned = pose.rotation * board_mm, x = turned + pose.translation_mm;
  const Eigen::Vector2d ideal = x.hnormalized();
  const double r2 = ideal.squaredNorm(), factor = calibration.distortion.factor(r2);
  const auto& k = calibration.distortion.k;
  const double slope = k[0] + r2 * (2 * k[1] + r2 * 3 * k[2]);  // of the factor, by r^2
  const Eigen::Vector2d focal(calibration.intrinsics(0, 0), calibration.intrinsics(1, 1));
  Eigen::Matrix<double, 2, 3> ideal_by_x;
  ideal_by_x << 1 / x.z(), 0, -ideal.x() / x.z(), 0, 1 / x.z(), -ideal.y() / x.z();
  const Eigen::Matrix2d seen_by_ideal =
      focal.asDiagonal() * (factor * Eigen::Matrix2d::Identity() + 2 * slope * ideal * ideal.transpose());
  Eigen::Matrix3d x_by_turn;
  x_by_turn << 0, turned.z(), -turned.y(), -turned.z(), 0, turned.x(), turned.y(), -turned.x(), 0;
  Eigen::Matrix<double, 2, 13> d = Eigen::Matrix<double, 2, 13>::Zero();
  d(0, 0) = factor * ideal.x();
  d(1, 1) = factor * ideal.y();
  d.block<2, 2>(0, 2).setIdentity();
  for (int i = 0; i < 3; ++i) d.col(4 + i) = focal.cwiseProduct(ideal) * std::pow(r2, i + 1);
  d.block<2, 3>(0, 7) = seen_by_ideal * ideal_by_x * x_by_turn;
  d.block<2, 3>(0, 10) = seen_by_ideal * ideal_by_x;
  return d;
}

/// The inner parameters that the model estimates, as columns of derivatives(); square pixels add column 1 to column 0.
std::vector<int> free_columns(const CalibrationModel& model) {
  std::vector<int> columns{0};
  if (!model.square_pixels) columns.push_back(1);
  if (model.principal_point) columns.insert(columns.end(), {2, 3});
  for (int i = 0; i < model.radial_terms; ++i) columns.push_back(4 + i);
  return columns;
}

}  // namespace

// The poses of different views are coupled only through the inner parameters, so each pose is eliminated separately
// (Schur complement).
void add_deviations(const std::vector<ViewPoints>& views, const CalibrationModel& model, CalibrationResult& result) {
  const std::vector<int> columns = free_columns(model);
  const Eigen::Index inner = Eigen::Index(columns.size());
  Eigen::MatrixXd reduced = Eigen::MatrixXd::Zero(inner, inner);
  std::vector<Matrix6d> pose_inverse;
  std::vector<Eigen::MatrixXd> coupling;
  double squares = 0, count = 0;
  for (std::size_t n = 0; n < views.size(); ++n) {
    CalibratedView& view = result.views[n];
    Matrix6d pose = Matrix6d::Zero();
    Eigen::MatrixXd both = Eigen::MatrixXd::Zero(6, inner);
    for (std::size_t i = 0; i < views[n].board_mm.size(); ++i) {
      auto d = derivatives(result.calibration, view.camera_from_world, views[n].board_mm[i]);
      if (model.square_pixels) d.col(0) += d.col(1);
      Eigen::MatrixXd by_inner(2, inner);
      for (Eigen::Index k = 0; k < inner; ++k) by_inner.col(k) = d.col(columns[std::size_t(k)]);
      const Eigen::Matrix<double, 2, 6> by_pose = d.rightCols<6>();
      reduced += by_inner.transpose() * by_inner;
      pose += by_pose.transpose() * by_pose;
      both += by_pose.transpose() * by_inner;
      view.residuals_px.push_back(views[n].pixels[i] -
                                  seen_at(result.calibration, view.camera_from_world, views[n].board_mm[i]));
      squares += view.residuals_px.back().squaredNorm();
      count += 2;
    }
    pose_inverse.push_back(inverse_of(pose));
    coupling.push_back(pose_inverse.back() * both);
    reduced -= both.transpose() * coupling.back();
  }
  const double variance = squares / std::max(1.0, count - double(inner) - 6 * double(views.size()));
  const Eigen::MatrixXd covariance = inverse_of(reduced);
  Eigen::VectorXd deviation = Eigen::VectorXd::Zero(7);
  for (Eigen::Index k = 0; k < inner; ++k) deviation[columns[std::size_t(k)]] = std::sqrt(variance * covariance(k, k));
  if (model.square_pixels) deviation[1] = deviation[0];
  Calibration& calibration = result.calibration;
  calibration.residual_px = std::sqrt(variance);
  calibration.focal_deviation_px = deviation.head<2>();
  calibration.principal_deviation_px = deviation.segment<2>(2);
  for (int i = 0; i < 3; ++i) calibration.distortion_deviation[std::size_t(i)] = deviation[4 + i];
  for (std::size_t n = 0; n < views.size(); ++n) {
    const Matrix6d pose = pose_inverse[n] + coupling[n] * covariance * coupling[n].transpose();
    result.views[n].deviation = (variance * pose.diagonal()).cwiseSqrt();
  }
}

namespace {

double starting_focal_px(const std::vector<ViewPoints>& views, const Eigen::Vector2d& middle_px) {
  std::vector<double> focals;
  for (const ViewPoints& view : views) {
    const auto start = closed_form_camera(view, middle_px);
    if (start && start->is_mirrored)
      throw Error("view '" + view.name +
                  "': only a mirrored image explains where the beads are seen; mirror the images left to right, or "
                  "check that the "
                  "board's file has a right-handed frame");
    if (start) focals.push_back(start->focal_px);
  }
  if (focals.empty())
    throw Error(
        "the beads that are seen do not determine a camera: at least 8 of them, on both sides of the board, are needed "
        "in a view");
  return quantile_in_place(focals, 0.5);
}

int solver_flags(const CalibrationModel& model) {
  int flags = cv::CALIB_USE_INTRINSIC_GUESS | cv::CALIB_ZERO_TANGENT_DIST;
  if (model.square_pixels) flags |= cv::CALIB_FIX_ASPECT_RATIO;
  if (!model.principal_point) flags |= cv::CALIB_FIX_PRINCIPAL_POINT;
  if (model.radial_terms < 1) flags |= cv::CALIB_FIX_K1;
  if (model.radial_terms < 2) flags |= cv::CALIB_FIX_K2;
  if (model.radial_terms < 3) flags |= cv::CALIB_FIX_K3;
  return flags;
}

}  // namespace

CalibrationResult calibrate(const std::vector<ViewPoints>& views, int width_px, int height_px,
                            const CalibrationModel& model) {
  const Eigen::Vector2d middle((width_px - 1) / 2.0, (height_px - 1) / 2.0);
  const double focal = starting_focal_px(views, middle);
  std::vector<std::vector<cv::Point3f>> points(views.size());
  std::vector<std::vector<cv::Point2f>> pixels(views.size());
  for (std::size_t n = 0; n < views.size(); ++n) {
    if (views[n].board_mm.size() < kLeastPoints)
      throw Error(
          formatted("view '{}': {} beads are seen; at least 8 are needed", views[n].name, views[n].board_mm.size()));
    for (const auto& p : views[n].board_mm) points[n].emplace_back(float(p.x()), float(p.y()), float(p.z()));
    for (const auto& p : views[n].pixels) pixels[n].emplace_back(float(p.x()), float(p.y()));
  }
  cv::Mat matrix = (cv::Mat_<double>(3, 3) << focal, 0, middle.x(), 0, focal, middle.y(), 0, 0, 1);
  cv::Mat distortion = cv::Mat::zeros(1, 5, CV_64F);
  std::vector<cv::Mat> turns, shifts;
  try {
    cv::calibrateCamera(points, pixels, {width_px, height_px}, matrix, distortion, turns, shifts, solver_flags(model),
                        {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 200, 1e-12});
  } catch (const cv::Exception& failure) {
    throw Error("the beads that are seen do not determine a camera (" + failure.err +
                "); take views with the board filling the image, tilted "
                "differently each time");
  }
  CalibrationResult result;
  result.calibration.width_px = width_px;
  result.calibration.height_px = height_px;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) result.calibration.intrinsics(r, c) = matrix.at<double>(r, c);
  result.calibration.distortion.k = {distortion.at<double>(0), distortion.at<double>(1), distortion.at<double>(4)};
  for (std::size_t n = 0; n < views.size(); ++n) {
    CalibratedView view;
    view.camera_from_world.rotation =
        rotation_from_vector(Eigen::Vector3d(turns[n].at<double>(0), turns[n].at<double>(1), turns[n].at<double>(2)));
    view.camera_from_world.translation_mm = {shifts[n].at<double>(0), shifts[n].at<double>(1), shifts[n].at<double>(2)};
    result.views.push_back(view);
  }
  if (!result.calibration.intrinsics.allFinite() || !(result.calibration.intrinsics(0, 0) > 0) ||
      !(result.calibration.intrinsics(1, 1) > 0))
    throw Error("no camera explains where the beads are seen; check the board's file against the board");
  add_deviations(views, model, result);
  return result;
}

}  // namespace marrow::calibration
