// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/bent_plate.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>

#include "marrow/domain/random.hpp"
#include "marrow/domain/transform.hpp"

namespace marrow::simulate {
namespace {

constexpr double kOpenAir = 40000;  ///< grey value, of 65535
constexpr int kSubsamples = 4;      ///< rays per pixel in each direction

/// The place of the straight image that a pixel shows: the fixed point of ideal + (pixel - seen(ideal)).
Eigen::Vector2d ideal_of(const Intensifier& intensifier, const Eigen::Vector2d& pixel) {
  Eigen::Vector2d ideal = pixel;
  for (int i = 0; i < 60; ++i) {
    const Eigen::Vector2d off = pixel - intensifier.seen_px(ideal);
    ideal += 0.9 * off;
    if (off.squaredNorm() < 1e-20) break;
  }
  return ideal;
}

/// Whether a place of the plate, in mm, lies in a hole or dot.
class Holes {
 public:
  Holes(const PlateScene& scene, std::uint64_t seed) : scene_(scene), seed_(seed) {}
  bool at(const Eigen::Vector2d& plate_mm) const {
    const Eigen::Vector2d at = plate_mm / scene_.spacing_mm;
    const double row = scene_.is_hexagonal ? at.y() / kRow : at.y();
    for (int r = int(std::floor(row)); r <= int(std::floor(row)) + 1; ++r) {
      const double aside = scene_.is_hexagonal ? 0.5 * r : 0, column = std::round(at.x() - aside);
      const Eigen::Vector2d centre(column + aside, scene_.is_hexagonal ? kRow * r : double(r));
      if ((at - centre).norm() * scene_.spacing_mm < 0.5 * scene_.dot_mm) return !is_missing(int(column), r);
    }
    return false;
  }

 private:
  static constexpr double kRow = 0.8660254037844386;
  bool is_missing(int column, int row) const {
    return Random(seed_, std::uint64_t(std::uint32_t(column)) << 32 | std::uint32_t(row)).uniform() <
           scene_.missing_share;
  }
  const PlateScene& scene_;
  std::uint64_t seed_;
};

/// What passes at a place of the straight image.
double transmission_at(const PlateScene& scene, const Holes& holes, const Eigen::Matrix3d& plate_from_ideal,
                       const Eigen::Vector2d& ideal) {
  const Eigen::Vector2d middle(0.5 * (scene.width_px - 1), 0.5 * (scene.height_px - 1));
  const Eigen::Vector2d off = ideal - middle;
  double passed = 1;
  if (off.x() > (2 * scene.covered_share - 1) * scene.field_px) {
    const bool is_hole = holes.at((plate_from_ideal * ideal.homogeneous()).hnormalized());
    passed = is_hole == scene.has_bright_dots ? 1 : scene.plate_transmission;
  }
  // The rod lies obliquely, to the right of the middle.
  if (std::abs(0.8 * off.x() - 0.6 * off.y() - 0.25 * scene.field_px) < 0.5 * scene.instrument_px) passed *= 0.1;
  return passed;
}

double beam_at(const PlateScene& scene, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d off = pixel - 0.5 * Eigen::Vector2d(scene.width_px - 1, scene.height_px - 1);
  const double radius = off.norm() / scene.field_px;
  if (radius > 1) return 0.02;
  return (1 - scene.vignetting * radius * radius) * (1 - scene.unevenness * (0.5 + 0.5 * off.y() / scene.field_px));
}

void add_noise(cv::Mat1d& signal, double photons, std::uint64_t seed) {
  tbb::parallel_for(0, signal.rows, [&](int v) {
    for (int u = 0; u < signal.cols; ++u) {
      Random random(seed, std::uint64_t(v) << 32 | std::uint64_t(u));
      double& value = signal(v, u);
      value = double(std::poisson_distribution<std::int64_t>(photons * value)(random)) / photons;
    }
  });
}

}  // namespace

Eigen::Vector2d Intensifier::seen_px(const Eigen::Vector2d& ideal_px) const {
  const Eigen::Vector2d off = ideal_px - middle_px;
  const double radius = off.norm(), s = radius * radius / (rim_px * rim_px);
  double growth = 1;
  if (pincushion_px != 0 && radius > 0) {
    const double rho = std::sqrt(rim_px * rim_px * rim_px / (3 * std::abs(pincushion_px)));
    const double within = std::min(radius / rho, 1.4);
    growth = pincushion_px > 0 ? std::tan(within) / within : std::atan(within) / within;
  }
  const double turn = turn_rad * (1 - std::exp(-2 * s)) / (1 - std::exp(-2.0));
  const Eigen::Vector2d turned(std::cos(turn) * off.x() - std::sin(turn) * off.y(),
                               std::sin(turn) * off.x() + std::cos(turn) * off.y());
  const double near = (ideal_px - iron_px).squaredNorm() / (0.09 * rim_px * rim_px);
  return middle_px + shift_px + growth * turned + iron_shift_px * std::exp(-near) * Eigen::Vector2d(0.8, 0.6);
}

Image image_of_plate(const PlateScene& scene, const Intensifier& intensifier, std::uint64_t seed) {
  const int width = scene.width_px, height = scene.height_px;
  std::vector<Eigen::Vector2d> ideal(std::size_t(width) * std::size_t(height));
  tbb::parallel_for(0, height, [&](int v) {
    for (int u = 0; u < width; ++u) ideal[std::size_t(v * width + u)] = ideal_of(intensifier, {u, v});
  });
  const Eigen::Matrix3d plate_from_ideal = scene.ideal_from_plate.inverse();
  const Holes holes(scene, Random(seed, 0x686f6c6573)());
  cv::Mat1d signal(height, width, 0.0);
  tbb::parallel_for(0, height, [&](int v) {
    for (int u = 0; u < width; ++u) {
      const Eigen::Vector2d at = ideal[std::size_t(v * width + u)];
      const int right = std::min(u + 1, width - 1), below = std::min(v + 1, height - 1);
      const Eigen::Vector2d along_u = ideal[std::size_t(v * width + right)] - ideal[std::size_t(v * width + right - 1)],
                            along_v =
                                ideal[std::size_t(below * width + u)] - ideal[std::size_t((below - 1) * width + u)];
      double passed = 0;
      for (int a = 0; a < kSubsamples; ++a)
        for (int b = 0; b < kSubsamples; ++b)
          passed += transmission_at(
              scene, holes, plate_from_ideal,
              at + ((a + 0.5) / kSubsamples - 0.5) * along_u + ((b + 0.5) / kSubsamples - 0.5) * along_v);
      signal(v, u) = passed / (kSubsamples * kSubsamples) * beam_at(scene, {u, v});
    }
  });
  if (scene.blur_px > 0) cv::GaussianBlur(signal, signal, {0, 0}, scene.blur_px, scene.blur_px, cv::BORDER_REPLICATE);
  if (scene.photons > 0) add_noise(signal, scene.photons, Random(seed, 0x6e6f697365)());
  Image image;
  signal.convertTo(image.pixels, CV_16U, kOpenAir);
  return image;
}

distortion::PlatePoints true_points(const PlateScene& scene, const Intensifier& intensifier, int count,
                                    std::uint64_t seed) {
  distortion::PlatePoints points;
  points.width_px = scene.width_px;
  points.height_px = scene.height_px;
  const Eigen::Vector2d middle(0.5 * (scene.width_px - 1), 0.5 * (scene.height_px - 1));
  Random random(seed, 0x7472757468);
  while (int(points.used.size()) < count) {
    const double radius = scene.field_px * std::sqrt(random.uniform()), angle = 2 * kPi * random.uniform();
    const Eigen::Vector2d seen = middle + radius * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    points.add(ideal_of(intensifier, seen), seen);
  }
  return points;
}

}  // namespace marrow::simulate
