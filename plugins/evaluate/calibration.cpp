// SPDX-License-Identifier: Apache-2.0
// Errors of a calibration, compared with the exact one of a simulated device.
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

using marrow::Calibration;

marrow::Metrics calibration_error(const Calibration& found, const Calibration& truth) {
  if (found.width_px != truth.width_px || found.height_px != truth.height_px)
    throw marrow::Error(marrow::formatted("the calibration is of images of {} x {} pixels, the truth of {} x {}",
                                          found.width_px, found.height_px, truth.width_px, truth.height_px));
  const auto focal_error = [&](int i) {
    return 100 * std::abs(found.intrinsics(i, i) - truth.intrinsics(i, i)) / truth.intrinsics(i, i);
  };
  const auto principal_error = [&](int i) { return std::abs(found.intrinsics(i, 2) - truth.intrinsics(i, 2)); };
  // A measurement depends on where both calibrations see the same ray. A shift of the principal point is nearly a
  // rotation of the whole device, which the poses of the views compensate. So the mean shift over the image is
  // subtracted.
  std::vector<Eigen::Vector2d> shifts;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  constexpr int kGrid = 20;
  for (int row = 0; row <= kGrid; ++row)
    for (int column = 0; column <= kGrid; ++column) {
      const Eigen::Vector2d pixel(column * (truth.width_px - 1.0) / kGrid, row * (truth.height_px - 1.0) / kGrid);
      shifts.push_back(distorted_pixel(found.intrinsics, found.distortion, pixel) -
                       distorted_pixel(truth.intrinsics, truth.distortion, pixel));
      mean += shifts.back();
    }
  mean /= double(shifts.size());
  double squares = 0;
  for (const auto& shift : shifts) squares += (shift - mean).squaredNorm();
  marrow::Metrics metrics;
  metrics.items.push_back({"focal_error", std::max(focal_error(0), focal_error(1)), "%"});
  metrics.items.push_back({"principal_u_error", principal_error(0), "px"});
  metrics.items.push_back({"principal_v_error", principal_error(1), "px"});
  metrics.items.push_back({"distortion_error", std::sqrt(squares / double(shifts.size())), "px"});
  metrics.items.push_back({"residual", found.residual_px, "px"});
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.calibration", calibration_error)
      .summary("Errors of a calibration, compared with the exact one of a simulated device")
      .in("calibration", "camera matrix and distortion that were found")
      .in("true_calibration", "exact camera matrix and distortion")
      .out("metrics",
           "errors of focal length and principal point, root mean square error of the distortion over the image, and "
           "the residual")
      .figures({"focal_error", "principal_u_error", "principal_v_error", "distortion_error", "residual"});
}
