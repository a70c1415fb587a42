// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/streaks.hpp"

#include <tbb/parallel_for.h>

#include <opencv2/imgproc.hpp>
#include <random>

#include "marrow/domain/random.hpp"
#include "marrow/simulate/solid.hpp"

namespace marrow::phantom {
namespace {

constexpr int kAngles = 240;
constexpr double kSmallestHu = -1024;
// A CT's beam is harder than a C-arm's. The share of each energy in the signal, for 120 kV: what lies above 70 keV
// counts as 70 keV.
constexpr Spectrum kCtShare{0.10, 0.18, 0.26, 0.46};

double mean_of(const Spectrum& per_mm) {
  double sum = 0;
  for (std::size_t e = 0; e < per_mm.size(); ++e) sum += kCtShare[e] * per_mm[e];
  return sum;
}

/// The line integral through metal and tissue that a beam of several energies measures.
double measured(const Spectrum& metal, double tissue_mm) {
  double sum = 0;
  for (std::size_t e = 0; e < metal.size(); ++e)
    sum += kCtShare[e] * std::exp(-(metal[e] + kMusclePerMm[e] * tissue_mm));
  return -std::log(sum);
}

/// The line integrals of the metal in one slice, for each energy. A row is an angle, a column a position across.
struct Sinogram {
  int columns;
  std::vector<Spectrum> values;
  Spectrum& at(int angle, int column) {
    return values[std::size_t(angle) * std::size_t(columns) + std::size_t(column)];
  }
};

class Slice {
 public:
  explicit Slice(const Grid& grid)
      : nx_(grid.size[0]),
        ny_(grid.size[1]),
        step_mm_(std::min(grid.spacing_mm.x(), grid.spacing_mm.y())),
        spacing_(grid.spacing_mm.head<2>()),
        middle_mm_(grid.origin_mm.head<2>() + 0.5 * Eigen::Vector2d(nx_ - 1, ny_ - 1).cwiseProduct(spacing_)),
        columns_(int(std::ceil(std::hypot(nx_ * spacing_.x(), ny_ * spacing_.y()) / step_mm_)) + 3) {
    for (int k = 0; k < kAngles; ++k) {
      const double angle = kPi * (k + 0.5) / kAngles;
      cosine_.push_back(std::cos(angle));
      sine_.push_back(std::sin(angle));
    }
  }

  /// The column to which a voxel is projected.
  double column_of(int angle, int x, int y) const {
    const double right = (x - 0.5 * (nx_ - 1)) * spacing_.x(), down = (y - 0.5 * (ny_ - 1)) * spacing_.y();
    return (right * cosine_[std::size_t(angle)] + down * sine_[std::size_t(angle)]) / step_mm_ + 0.5 * (columns_ - 1);
  }

  Sinogram project(const std::vector<Spectrum>& metal) const {
    Sinogram sinogram{columns_, std::vector<Spectrum>(std::size_t(kAngles) * std::size_t(columns_), Spectrum{})};
    for (int y = 0; y < ny_; ++y)
      for (int x = 0; x < nx_; ++x) {
        const Spectrum& here = metal[std::size_t(y) * std::size_t(nx_) + std::size_t(x)];
        if (!(here[0] > 0)) continue;
        for (int k = 0; k < kAngles; ++k) {
          const double column = column_of(k, x, y);
          const int first = int(std::floor(column));
          for (int side = 0; side < 2; ++side) {
            const double share = (side == 0 ? first + 1 - column : column - first) * spacing_.prod() / step_mm_;
            Spectrum& sum = sinogram.at(k, first + side);
            for (std::size_t e = 0; e < sum.size(); ++e) sum[e] += share * here[e];
          }
        }
      }
    return sinogram;
  }

  /// The error of each line integral. It is zero where a line meets no metal.
  std::vector<double> errors(Sinogram& sinogram, const StreakOptions& options, Random& random) const {
    std::vector<double> errors(sinogram.values.size(), 0.0);
    for (int k = 0; k < kAngles; ++k)
      for (int c = 0; c < columns_; ++c) {
        const Spectrum& metal = sinogram.at(k, c);
        if (!(metal[0] > 1e-9)) continue;
        const double off = (c - 0.5 * (columns_ - 1)) * step_mm_ -
                           ((options.tissue_centre_mm - middle_mm_).x() * cosine_[std::size_t(k)] +
                            (options.tissue_centre_mm - middle_mm_).y() * sine_[std::size_t(k)]);
        const double radius = options.tissue_radius_mm,
                     tissue = 2 * std::sqrt(std::max(0.0, radius * radius - off * off));
        const double exact = measured(metal, tissue);
        const double photons = options.photons * std::exp(-exact);
        const double seen = std::max(1.0, double(std::poisson_distribution<std::int64_t>(photons)(random)));
        const double found = std::log(options.photons / seen);
        errors[std::size_t(k) * std::size_t(columns_) + std::size_t(c)] =
            options.strength * (found - measured({}, tissue) - mean_of(metal));
      }
    return errors;
  }

  /// Filtered back-projection with the ramp filter (Kak and Slaney 1988, Eq 3.61), in 1/mm.
  cv::Mat1d back_projected(const std::vector<double>& errors) const {
    cv::Mat1d image(ny_, nx_, 0.0);
    std::vector<double> filtered(std::size_t(columns_), 0.0);
    for (int k = 0; k < kAngles; ++k) {
      const double* row = errors.data() + std::size_t(k) * std::size_t(columns_);
      std::fill(filtered.begin(), filtered.end(), 0.0);
      for (int from = 0; from < columns_; ++from) {
        if (row[from] == 0) continue;
        for (int to = 0; to < columns_; ++to) {
          const int n = std::abs(to - from);
          const double weight = n == 0 ? 0.25 : n % 2 == 0 ? 0 : -1 / (kPi * kPi * n * n);
          filtered[std::size_t(to)] += row[from] * weight / step_mm_;
        }
      }
      for (int y = 0; y < ny_; ++y)
        for (int x = 0; x < nx_; ++x) {
          const double column = column_of(k, x, y);
          const std::size_t first = std::size_t(column);
          const double share = column - double(first);
          image(y, x) += kPi / kAngles * ((1 - share) * filtered[first] + share * filtered[first + 1]);
        }
    }
    return image;
  }

 private:
  int nx_, ny_;
  double step_mm_;
  Eigen::Vector2d spacing_, middle_mm_;
  int columns_;
  std::vector<double> cosine_, sine_;
};

}  // namespace

void add_metal_streaks(Volume& volume, const std::vector<const Body*>& bodies, const StreakOptions& options,
                       std::uint64_t seed) {
  const Grid& grid = volume.grid;
  std::vector<const Body*> metals;
  for (const Body* body : bodies)
    if (material(body->material).is_metal) metals.push_back(body);
  if (metals.empty()) return;
  const BodyRays rays(metals, grid.size[1], grid.size[2], [&](const Body& body) {
    return [&grid, ct_from_world = body.ct_from_world](const Eigen::Vector3d& point) {
      const Eigen::Vector3d index = (ct_from_world * point - grid.origin_mm).cwiseQuotient(grid.spacing_mm);
      return RayVertex{index.y(), index.z(), index.x()};
    };
  });
  const Slice slice(grid);
  const std::size_t width = std::size_t(grid.size[0]), count = width * std::size_t(grid.size[1]);
  const double water = mean_of(kMusclePerMm);
  double densest = 0;
  for (const Body* body : metals) densest = std::max(densest, mean_of(material(body->material).per_mm));
  tbb::parallel_for(0, grid.size[2], [&](int z) {
    const auto crossings = rays.bundle().crossings(z, z + 1);
    float* values = volume.values.data() + count * std::size_t(z);
    if (!crossings.empty()) {
      std::vector<Spectrum> metal(count, Spectrum{});
      std::vector<BodyInterval> intervals;
      for_each_ray(crossings, [&](std::span<const Crossing> ray) {
        rays.intervals(ray, intervals);
        for (const BodyInterval& interval : intervals) {
          const Spectrum& per_mm = material(metals[std::size_t(interval.body)]->material).per_mm;
          const int first = std::max(0, int(std::floor(interval.from + 0.5))),
                    last = std::min(grid.size[0] - 1, int(std::floor(interval.to + 0.5)));
          for (int x = first; x <= last; ++x) {
            const double share = std::min(interval.to, x + 0.5) - std::max(interval.from, x - 0.5);
            Spectrum& here = metal[ray.front().column * width + std::size_t(x)];
            // Where screw and plate overlap, the stronger counts.
            for (std::size_t e = 0; e < here.size(); ++e) here[e] = std::max(here[e], std::max(0.0, share) * per_mm[e]);
          }
        }
      });
      Random random(seed, std::uint64_t(z));
      Sinogram sinogram = slice.project(metal);
      cv::Mat1d change = slice.back_projected(slice.errors(sinogram, options, random));
      // The volume holds metal as the largest value. What the scanner would have found is added before the cut.
      for (std::size_t i = 0; i < count; ++i) {
        double& hu = change(int(i / width), int(i % width));
        const double share = std::min(1.0, mean_of(metal[i]) / densest);
        hu = 1000 / water * hu + share * std::max(0.0, 1000 * (densest / water - 1) - kLargestHu);
      }
      const double sigma_x = options.blur_mm / grid.spacing_mm.x(), sigma_y = options.blur_mm / grid.spacing_mm.y();
      if (options.blur_mm > 0) cv::GaussianBlur(change, change, {0, 0}, sigma_x, sigma_y, cv::BORDER_REPLICATE);
      for (std::size_t i = 0; i < count; ++i) values[i] += float(change(int(i / width), int(i % width)));
    }
    for (std::size_t i = 0; i < count; ++i)
      values[i] = std::clamp(std::round(values[i]), float(kSmallestHu), float(kLargestHu));
  });
}

}  // namespace marrow::phantom
