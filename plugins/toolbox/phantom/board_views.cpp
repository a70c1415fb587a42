// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/phantom/board_views.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "marrow/base/error.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::phantom {
namespace {

constexpr double kGrey = 40000;  ///< grey value (of 65535) in the middle of an image without beads
constexpr int kSubsamples = 3;   ///< rays per pixel in each direction

Eigen::Vector3d middle_of(const calibration::Board& board) {
  Eigen::Vector3d low = board.beads[0].centre_mm, high = low;
  for (const auto& bead : board.beads) {
    low = low.cwiseMin(bead.centre_mm);
    high = high.cwiseMax(bead.centre_mm);
  }
  return 0.5 * (low + high);
}

/// The ray through a pixel position of the image as taken, at depth 1. Newton's method inverts the distortion of the
/// radius.
Eigen::Vector3d ray_of(const Calibration& device, double u, double v) {
  const Eigen::Vector2d seen((u - device.intrinsics(0, 2)) / device.intrinsics(0, 0),
                             (v - device.intrinsics(1, 2)) / device.intrinsics(1, 1));
  const double target = seen.norm();
  if (target == 0) return {0, 0, 1};
  const auto& k = device.distortion.k;
  double radius = target;
  for (int i = 0; i < 20; ++i) {
    const double s = radius * radius;
    const double value = radius * (1 + s * (k[0] + s * (k[1] + s * k[2]))) - target;
    radius -= value / (1 + s * (3 * k[0] + s * (5 * k[1] + s * 7 * k[2])));
    if (std::abs(value) < 1e-14) break;
  }
  const Eigen::Vector2d ideal = seen * (radius / target);
  return {ideal.x(), ideal.y(), 1};
}

double chord_mm(const Eigen::Vector3d& direction, const Eigen::Vector3d& centre, double radius) {
  const double along = direction.dot(centre);
  const double squared = radius * radius - centre.squaredNorm() + along * along;
  return squared > 0 ? 2 * std::sqrt(squared) : 0;
}

}  // namespace

Calibration make_device(const DeviceOptions& options) {
  Calibration device;
  device.width_px = options.width_px;
  device.height_px = options.height_px;
  const double focal = options.source_to_detector_mm / options.pixel_mm;
  device.intrinsics << focal, 0, (options.width_px - 1) / 2.0 + options.principal_offset_px.x(), 0, focal,
      (options.height_px - 1) / 2.0 + options.principal_offset_px.y(), 0, 0, 1;
  const double edge = options.width_px / 2.0 / focal, share = options.pincushion_share_r4;
  device.distortion.k = {(1 - share) * options.pincushion_percent / 100 / (edge * edge),
                         share * options.pincushion_percent / 100 / std::pow(edge, 4), 0};
  return device;
}

std::vector<RigidTransform> draw_board_poses(const calibration::Board& board, const BoardPoses& poses,
                                             std::uint64_t seed) {
  const Eigen::Vector3d middle = middle_of(board);
  std::vector<RigidTransform> all;
  Random random(seed, 0x626f617264);
  const double first = 2 * kPi * random.uniform_above_0();
  for (int i = 0; i < poses.views; ++i) {
    const double towards = first + 2 * kPi * i / poses.views;
    const double tilt = radians(poses.tilt_deg) * (0.5 + 0.5 * random.uniform_above_0()),
                 roll = 2 * kPi * random.uniform_above_0();
    RigidTransform pose{"camera", "world"};
    pose.rotation = (Eigen::AngleAxisd(tilt, Eigen::Vector3d(std::cos(towards), std::sin(towards), 0)) *
                     Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()))
                        .toRotationMatrix();
    const auto shift = [&] { return poses.shift_mm * (2 * random.uniform_above_0() - 1); };
    const double right = shift(), down = shift();
    pose.translation_mm = Eigen::Vector3d(right, down, poses.distance_mm) - pose.rotation * middle;
    all.push_back(pose);
  }
  return all;
}

Eigen::Vector2d image_of(const Calibration& device, const RigidTransform& camera_from_board,
                         const Eigen::Vector3d& board_mm) {
  const Eigen::Vector3d x = camera_from_board * board_mm;
  const Eigen::Vector2d ideal(x.x() / x.z(), x.y() / x.z());
  const double s = ideal.squaredNorm();
  const auto& k = device.distortion.k;
  const double factor = 1 + k[0] * s + k[1] * s * s + k[2] * s * s * s;
  return {device.intrinsics(0, 0) * factor * ideal.x() + device.intrinsics(0, 2),
          device.intrinsics(1, 1) * factor * ideal.y() + device.intrinsics(1, 2)};
}

Image expose_board(const calibration::Board& board, const Calibration& device, const RigidTransform& camera_from_board,
                   const Exposure& exposure, std::uint64_t seed) {
  const int width = device.width_px, height = device.height_px;
  cv::Mat1d signal(height, width, 0.0);
  std::vector<Eigen::Vector3d> centres;
  std::vector<Eigen::Vector3d> places;  // for each bead its pixel (u, v), and the distance within which it can darken
  for (const auto& bead : board.beads) {
    centres.push_back(camera_from_board * bead.centre_mm);
    if (!(centres.back().z() > bead.diameter_mm))
      throw Error("the board reaches to the X-ray source; check its distance");
    const Eigen::Vector2d at = image_of(device, camera_from_board, bead.centre_mm);
    places.emplace_back(at.x(), at.y(), 4 + device.intrinsics(0, 0) * bead.diameter_mm / centres.back().z());
  }
  const double half_diagonal = 0.5 * std::hypot(width, height);
  tbb::parallel_for(0, height, [&](int v) {
    std::vector<std::size_t> near;
    for (int u = 0; u < width; ++u) {
      near.clear();
      for (std::size_t i = 0; i < places.size(); ++i)
        if (std::abs(u - places[i].x()) < places[i].z() && std::abs(v - places[i].y()) < places[i].z())
          near.push_back(i);
      double passed = near.empty() ? 1 : 0;
      for (int a = 0; a < kSubsamples && !near.empty(); ++a)
        for (int b = 0; b < kSubsamples; ++b) {
          const Eigen::Vector3d ray =
              ray_of(device, u + (a + 0.5) / kSubsamples - 0.5, v + (b + 0.5) / kSubsamples - 0.5).normalized();
          double metal_mm = 0;
          for (std::size_t i : near) metal_mm += chord_mm(ray, centres[i], 0.5 * board.beads[i].diameter_mm);
          passed += std::exp(-exposure.attenuation_per_mm * metal_mm) / (kSubsamples * kSubsamples);
        }
      const double off = std::hypot(u - 0.5 * width, v - 0.5 * height) / half_diagonal;
      signal(v, u) = passed * (1 - exposure.vignetting * off * off);
    }
  });
  if (exposure.photons > 0)
    tbb::parallel_for(0, height, [&](int v) {
      for (int u = 0; u < width; ++u) {
        Random random(seed, std::uint64_t(v) << 32 | std::uint64_t(u));
        double& value = signal(v, u);
        value = double(std::poisson_distribution<std::int64_t>(exposure.photons * value)(random)) / exposure.photons;
      }
    });
  if (exposure.blur_px > 0)
    cv::GaussianBlur(signal, signal, {0, 0}, exposure.blur_px, exposure.blur_px, cv::BORDER_REPLICATE);
  Image image;
  signal.convertTo(image.pixels, CV_16U, kGrey);
  return image;
}

}  // namespace marrow::phantom
