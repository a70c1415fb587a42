// SPDX-License-Identifier: Apache-2.0
// A CT of the phantom: the continuous shape on rays 0.3 mm apart at most, blurred and sampled, with noise.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <marrow/plugin.hpp>

#include "random.hpp"
#include "solid.hpp"

namespace {

using namespace marrow;
using simulate::Interval;
using simulate::Phantom;

struct CtOptions {
  std::array<double, 3> spacing_mm{0.8, 0.8, 1.0};
  double margin_mm = 12;
  std::array<double, 2> range_mm{0, 0};
  double blur_mm = 0.5;
  double noise_hu = 30;
  double cortical_hu = 1450;
  double marrow_hu = -20;
  double muscle_hu = 50;
  double fat_hu = -100;
};

constexpr double kAirHu = -1000;
constexpr double kFinestMm = 0.3;
constexpr int kSlabSlices = 16;

/// The fine raster under a grid: along x in bins that take exact lengths, along y and z in rays.
struct Raster {
  std::array<int, 3> steps;  // fine samples per voxel
  std::array<int, 3> halo;   // fine samples beyond the grid on each side, for the blur
  Eigen::Vector3d spacing_mm, origin_mm;
  std::array<int, 3> size;
};

Grid grid_around(const Phantom& phantom, const CtOptions& options) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (const auto& fragment : phantom.fragments)
    for (const auto& vertex : phantom.bone.outer.vertices_mm) {
      const Eigen::Vector3d point = fragment.ct_from_bone * vertex;
      low = low.cwiseMin(point);
      high = high.cwiseMax(point);
    }
  const double distal_end = low.z();
  low.array() -= options.margin_mm;
  high.array() += options.margin_mm;
  if (options.range_mm[1] > options.range_mm[0]) {
    low.z() = std::max(low.z(), distal_end + options.range_mm[0]);
    high.z() = std::min(high.z(), distal_end + options.range_mm[1]);
  }
  Grid grid;
  for (int k = 0; k < 3; ++k) {
    grid.spacing_mm[k] = options.spacing_mm[std::size_t(k)];
    grid.size[std::size_t(k)] = int(std::floor((high[k] - low[k]) / grid.spacing_mm[k])) + 1;
  }
  grid.origin_mm = low;
  if (!(high.z() > low.z()) || grid.size[2] < 2)
    throw Error("simulate.ct: range_mm " + std::to_string(options.range_mm[0]) + " to " + std::to_string(options.range_mm[1]) +
                " (from the distal end) holds no part of the bone");
  return grid;
}

Raster raster_under(const Grid& grid, double blur_mm) {
  Raster raster;
  for (int k = 0; k < 3; ++k) {
    const std::size_t i = std::size_t(k);
    raster.steps[i] = std::max(1, int(std::ceil(grid.spacing_mm[k] / kFinestMm)));
    raster.spacing_mm[k] = grid.spacing_mm[k] / raster.steps[i];
    raster.halo[i] = int(std::ceil(4 * blur_mm / raster.spacing_mm[k]));
    raster.size[i] = (grid.size[i] - 1) * raster.steps[i] + 1 + 2 * raster.halo[i];
    raster.origin_mm[k] = grid.origin_mm[k] - raster.halo[i] * raster.spacing_mm[k];
  }
  return raster;
}

/// Weights of a sampled Gaussian over the halo; sum 1.
std::vector<double> point_spread(double blur_mm, double spacing_mm, int halo) {
  std::vector<double> weights;
  double sum = 0;
  for (int i = -halo; i <= halo; ++i) {
    const double t = blur_mm > 0 ? i * spacing_mm / blur_mm : 0;
    weights.push_back(std::exp(-0.5 * t * t));
    sum += weights.back();
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

class Scanner {
 public:
  Scanner(const Phantom& phantom, const Grid& grid, const CtOptions& options)
      : phantom_(phantom), grid_(grid), options_(options), raster_(raster_under(grid, options.blur_mm)), fill_(phantom.bone),
        rays_(phantom, raster_.size[1], raster_.size[2], [this](const simulate::Fragment& fragment) {
          return [this, ct_from_bone = fragment.ct_from_bone](const Eigen::Vector3d& point) {
            const Eigen::Vector3d fine = (ct_from_bone * point - raster_.origin_mm).cwiseQuotient(raster_.spacing_mm);
            return simulate::RayVertex{fine.y(), fine.z(), fine.x()};
          };
        }) {
    for (int k = 0; k < 3; ++k)
      spread_[std::size_t(k)] = point_spread(options.blur_mm, raster_.spacing_mm[k], raster_.halo[std::size_t(k)]);
    background_ = background();
  }

  /// Slices first to last - 1 without noise.
  void scan(int first, int last, std::vector<float>& values) const {
    const std::size_t slice = std::size_t(grid_.size[0]) * std::size_t(grid_.size[1]);
    const int fine_first = first * raster_.steps[2], fine_last = (last - 1) * raster_.steps[2] + 2 * raster_.halo[2] + 1;
    std::vector<double> sums(slice * std::size_t(last - first), 0.0);
    const auto crossings = rays_.bundle().crossings(fine_first, fine_last);
    std::size_t next = 0;
    std::vector<double> plane;
    for (int row = fine_first; row < fine_last; ++row) {
      plane = background_;
      std::vector<simulate::Crossing> of_row;
      for (; next < crossings.size() && int(crossings[next].row) == row; ++next) of_row.push_back(crossings[next]);
      draw(of_row, row, plane);
      const std::vector<double> blurred = sampled(plane);
      for (int z = first; z < last; ++z) {
        const int tap = row - z * raster_.steps[2];
        if (tap < 0 || tap > 2 * raster_.halo[2]) continue;
        const double weight = spread_[2][std::size_t(tap)];
        double* sum = sums.data() + slice * std::size_t(z - first);
        for (std::size_t i = 0; i < slice; ++i) sum[i] += weight * blurred[i];
      }
    }
    std::copy(sums.begin(), sums.end(), values.begin() + std::ptrdiff_t(slice * std::size_t(first)));
  }

 private:
  /// Muscle, fat and air on the fine raster; the same for all z.
  std::vector<double> background() const {
    const auto& bone = phantom_.bone;
    std::vector<double> plane;
    for (int y = 0; y < raster_.size[1]; ++y)
      for (int x = 0; x < raster_.size[0]; ++x) {
        const Eigen::Vector2d point(raster_.origin_mm.x() + x * raster_.spacing_mm.x(),
                                    raster_.origin_mm.y() + y * raster_.spacing_mm.y());
        const double depth = bone.thigh_radius_mm - (point - bone.thigh_centre_mm).norm();
        plane.push_back(depth < 0 ? kAirHu : depth < bone.fat_mm ? options_.fat_hu : options_.muscle_hu);
      }
    return plane;
  }

  /// Puts the bone of one fine row of rays into the plane, each bin by the length that the bone takes of it.
  void draw(const std::vector<simulate::Crossing>& crossings, int row, std::vector<double>& plane) const {
    const double z_ct = raster_.origin_mm.z() + row * raster_.spacing_mm.z();
    std::vector<Interval> intervals;
    simulate::for_each_ray(crossings, [&](std::span<const simulate::Crossing> ray) {
      rays_.intervals(ray, intervals);
      const int y = int(ray.front().column);
      double* bins = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      const double* empty = background_.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      for (const Interval& interval : intervals) {
        const auto bone_from_ct = inverse(phantom_.fragments[std::size_t(interval.fragment)].ct_from_bone);
        const double x_ct = raster_.origin_mm.x() + 0.5 * (interval.from + interval.to) * raster_.spacing_mm.x();
        const Eigen::Vector3d middle = bone_from_ct * Eigen::Vector3d(x_ct, raster_.origin_mm.y() + y * raster_.spacing_mm.y(), z_ct);
        const double fraction = interval.cortical ? 1 : fill_.at(middle.z());
        const double hu = fraction * options_.cortical_hu + (1 - fraction) * options_.marrow_hu;
        const int first = std::max(0, int(std::floor(interval.from + 0.5)));
        const int last = std::min(raster_.size[0] - 1, int(std::floor(interval.to + 0.5)));
        for (int x = first; x <= last; ++x) {
          const double share = std::min(interval.to, x + 0.5) - std::max(interval.from, x - 0.5);
          bins[x] += std::max(0.0, share) * (hu - empty[x]);
        }
      }
    });
  }

  /// A fine plane blurred in x and y, at the grid's positions.
  std::vector<double> sampled(const std::vector<double>& plane) const {
    const int nx = grid_.size[0], ny = grid_.size[1];
    std::vector<double> rows(std::size_t(nx) * std::size_t(raster_.size[1]));
    for (int y = 0; y < raster_.size[1]; ++y)
      for (int x = 0; x < nx; ++x) {
        const double* from = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]) + std::size_t(x * raster_.steps[0]);
        double sum = 0;
        for (double weight : spread_[0]) sum += weight * *from++;
        rows[std::size_t(y) * std::size_t(nx) + std::size_t(x)] = sum;
      }
    std::vector<double> result(std::size_t(nx) * std::size_t(ny), 0.0);
    for (int y = 0; y < ny; ++y)
      for (std::size_t tap = 0; tap < spread_[1].size(); ++tap) {
        const double weight = spread_[1][tap];
        const double* from = rows.data() + (std::size_t(y * raster_.steps[1]) + tap) * std::size_t(nx);
        double* to = result.data() + std::size_t(y) * std::size_t(nx);
        for (int x = 0; x < nx; ++x) to[x] += weight * from[x];
      }
    return result;
  }

  const Phantom& phantom_;
  const Grid& grid_;
  const CtOptions& options_;
  Raster raster_;
  simulate::Fill fill_;
  simulate::SolidRays rays_;
  std::array<std::vector<double>, 3> spread_;
  std::vector<double> background_;
};

Volume scan(const Phantom& phantom, const CtOptions& options, Context& context) {
  simulate::check_phantom(phantom, "simulate.ct");
  for (double spacing : options.spacing_mm)
    if (!(spacing > 0)) throw Error("simulate.ct: spacing_mm must be positive, got " + std::to_string(spacing));
  Volume volume;
  volume.grid = grid_around(phantom, options);
  volume.values.resize(volume.grid.count());
  const Scanner scanner(phantom, volume.grid, options);
  const int slabs = (volume.grid.size[2] + kSlabSlices - 1) / kSlabSlices;
  const std::size_t slice = std::size_t(volume.grid.size[0]) * std::size_t(volume.grid.size[1]);
  std::atomic<int> done = 0;
  tbb::parallel_for(0, slabs, [&](int slab) {
    context.check_cancelled();
    const int first = slab * kSlabSlices, last = std::min(volume.grid.size[2], first + kSlabSlices);
    scanner.scan(first, last, volume.values);
    for (std::size_t i = std::size_t(first) * slice; i < std::size_t(last) * slice; ++i) {
      simulate::Random random(context.seed(), i);
      volume.values[i] = std::round(float(volume.values[i] + options.noise_hu * random.normal()));
    }
    context.progress(double(++done) / slabs, "slices");
  });
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.ct", scan)
      .summary("CT of a simulated bone, sampled from its continuous shape with blur and noise")
      .random()
      .in("phantom", "bone, fracture and fragments")
      .out("volume", "CT in Hounsfield units, whole numbers")
      .option("spacing_mm", &CtOptions::spacing_mm, "voxel size along x, y, z")
      .option("margin_mm", &CtOptions::margin_mm, "space around the bone", at_least(0))
      .option("range_mm", &CtOptions::range_mm,
              "only the slices between these heights above the bone's distal end; [0, 0] = the whole bone")
      .option("blur_mm", &CtOptions::blur_mm, "standard deviation of the Gaussian point-spread function", at_least(0), at_most(3))
      .option("noise_hu", &CtOptions::noise_hu, "standard deviation of the noise", at_least(0), unit("HU"))
      .option("cortical_hu", &CtOptions::cortical_hu, "compact bone", unit("HU"))
      .option("marrow_hu", &CtOptions::marrow_hu, "marrow", unit("HU"))
      .option("muscle_hu", &CtOptions::muscle_hu, "muscle", unit("HU"))
      .option("fat_hu", &CtOptions::fat_hu, "fat under the skin", unit("HU"));
}
