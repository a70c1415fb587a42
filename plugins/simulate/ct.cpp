// SPDX-License-Identifier: Apache-2.0
// A CT of the phantom. The continuous shape is cut by rays that are at most 0.3 mm apart, blurred, sampled, and gets
// noise.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/phantom/solid.hpp"

namespace {

using namespace marrow;
using phantom::Interval;
using phantom::Phantom;

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

/// The fine raster of a grid. Along y and z it consists of rays, along x of bins that take exact lengths.
struct Raster {
  std::array<int, 3> steps;  // fine samples per voxel
  std::array<int, 3> halo;   // fine samples beyond the grid on each side, for the blur
  Eigen::Vector3d spacing_mm, origin_mm;
  std::array<int, 3> size;
};

/// All x, y with x0 <= x < x1 and y0 <= y < y1. Empty if x0 >= x1.
struct Rectangle {
  int x0, x1, y0, y1;
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
    throw Error("simulate.ct: range_mm " + std::to_string(options.range_mm[0]) + " to " +
                std::to_string(options.range_mm[1]) + " (from the distal end) holds no part of the bone");
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

/// Weights of a sampled Gaussian over the halo. Their sum is 1.
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
      : phantom_(phantom),
        grid_(grid),
        options_(options),
        raster_(raster_under(grid, options.blur_mm)),
        fill_(phantom.bone),
        rays_(phantom, raster_.size[1], raster_.size[2], [this](const phantom::Fragment& fragment) {
          return [this, ct_from_bone = fragment.ct_from_bone](const Eigen::Vector3d& point) {
            const Eigen::Vector3d fine = (ct_from_bone * point - raster_.origin_mm).cwiseQuotient(raster_.spacing_mm);
            return phantom::RayVertex{fine.y(), fine.z(), fine.x()};
          };
        }) {
    for (int k = 0; k < 3; ++k)
      spread_[std::size_t(k)] = point_spread(options.blur_mm, raster_.spacing_mm[k], raster_.halo[std::size_t(k)]);
    background_fine_ = background();
    background_.resize(std::size_t(grid.size[0]) * std::size_t(grid.size[1]));
    blur(background_fine_, {0, raster_.size[0], 0, raster_.size[1]}, background_);
  }

  /// Computes the slices first to last - 1, without noise.
  void scan(int first, int last, std::vector<float>& values) const {
    const std::size_t slice = background_.size();
    const int fine_first = first * raster_.steps[2],
              fine_last = (last - 1) * raster_.steps[2] + 2 * raster_.halo[2] + 1;
    std::vector<double> sums;
    for (int z = first; z < last; ++z) sums.insert(sums.end(), background_.begin(), background_.end());
    const auto crossings = rays_.bundle().crossings(fine_first, fine_last);
    std::vector<double> plane(background_fine_.size(), 0.0), blurred(slice, 0.0);
    for (auto at = crossings.begin(); at != crossings.end();) {
      const auto row_end =
          std::find_if(at, crossings.end(), [&](const auto& crossing) { return crossing.row != at->row; });
      const int row = int(at->row);
      const Rectangle bone = draw({at, row_end}, row, plane);
      const Rectangle seen = blur(plane, bone, blurred);
      for (int z = first; z < last; ++z) {
        const int tap = row - z * raster_.steps[2];
        if (tap < 0 || tap > 2 * raster_.halo[2]) continue;
        const double weight = spread_[2][std::size_t(tap)];
        for (int y = seen.y0; y < seen.y1; ++y) {
          const std::size_t line = std::size_t(y) * std::size_t(grid_.size[0]);
          double* sum = sums.data() + slice * std::size_t(z - first) + line;
          for (int x = seen.x0; x < seen.x1; ++x) sum[x] += weight * blurred[line + std::size_t(x)];
        }
      }
      for (int y = bone.y0; y < bone.y1; ++y) {
        double* line = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]);
        std::fill(line + bone.x0, line + bone.x1, 0.0);
      }
      at = row_end;
    }
    std::copy(sums.begin(), sums.end(), values.begin() + std::ptrdiff_t(slice * std::size_t(first)));
  }

 private:
  /// Muscle, fat and air on the fine raster.
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

  /// Adds the bone in one fine row of rays to the plane, as the difference to the background. Each bin counts by the
  /// length of bone in it. Returns the changed part of the plane.
  Rectangle draw(std::span<const phantom::Crossing> crossings, int row, std::vector<double>& plane) const {
    Rectangle touched{raster_.size[0], 0, raster_.size[1], 0};
    const double z_ct = raster_.origin_mm.z() + row * raster_.spacing_mm.z();
    std::vector<Interval> intervals;
    phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
      rays_.intervals(ray, intervals);
      const int y = int(ray.front().column);
      double* bins = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      const double* empty = background_fine_.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      for (const Interval& interval : intervals) {
        const auto bone_from_ct = inverse(phantom_.fragments[std::size_t(interval.fragment)].ct_from_bone);
        const double x_ct = raster_.origin_mm.x() + 0.5 * (interval.from + interval.to) * raster_.spacing_mm.x();
        const Eigen::Vector3d middle =
            bone_from_ct * Eigen::Vector3d(x_ct, raster_.origin_mm.y() + y * raster_.spacing_mm.y(), z_ct);
        const double fraction = interval.cortical ? 1 : fill_.at(middle.z());
        const double hu = fraction * options_.cortical_hu + (1 - fraction) * options_.marrow_hu;
        const int first = std::max(0, int(std::floor(interval.from + 0.5)));
        const int last = std::min(raster_.size[0] - 1, int(std::floor(interval.to + 0.5)));
        touched = {std::min(touched.x0, first), std::max(touched.x1, last + 1), std::min(touched.y0, y),
                   std::max(touched.y1, y + 1)};
        for (int x = first; x <= last; ++x) {
          const double share = std::min(interval.to, x + 0.5) - std::max(interval.from, x - 0.5);
          bins[x] += std::max(0.0, share) * (hu - empty[x]);
        }
      }
    });
    return touched;
  }

  /// Blurs a fine plane in x and y and samples it at the grid's positions. The plane must be zero outside `bone`.
  /// Returns the part of `blurred` that is set.
  Rectangle blur(const std::vector<double>& plane, const Rectangle& bone, std::vector<double>& blurred) const {
    const int nx = grid_.size[0], ny = grid_.size[1], sx = raster_.steps[0], sy = raster_.steps[1];
    const int hx = raster_.halo[0], hy = raster_.halo[1];
    // Position i uses the fine samples i * step to i * step + 2 * halo.
    const auto first = [](int fine, int halo, int step) { return std::max(0, (fine - 2 * halo + step - 1) / step); };
    const Rectangle seen{first(bone.x0, hx, sx), std::min(nx, (bone.x1 - 1) / sx + 1), first(bone.y0, hy, sy),
                         std::min(ny, (bone.y1 - 1) / sy + 1)};
    const int width = std::max(0, seen.x1 - seen.x0);
    std::vector<double> rows(std::size_t(width) * std::size_t(std::max(0, bone.y1 - bone.y0)));
    for (int y = bone.y0; y < bone.y1; ++y)
      for (int x = seen.x0; x < seen.x1; ++x) {
        const double* from = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]) + std::size_t(x * sx);
        double sum = 0;
        for (double weight : spread_[0]) sum += weight * *from++;
        rows[std::size_t(y - bone.y0) * std::size_t(width) + std::size_t(x - seen.x0)] = sum;
      }
    for (int y = seen.y0; y < seen.y1; ++y) {
      double* to = blurred.data() + std::size_t(y) * std::size_t(nx) + std::size_t(seen.x0);
      std::fill(to, to + width, 0.0);
      for (int fine = std::max(bone.y0, y * sy); fine < std::min(bone.y1, y * sy + 2 * hy + 1); ++fine) {
        const double weight = spread_[1][std::size_t(fine - y * sy)];
        const double* from = rows.data() + std::size_t(fine - bone.y0) * std::size_t(width);
        for (int x = 0; x < width; ++x) to[x] += weight * from[x];
      }
    }
    return seen;
  }

  const Phantom& phantom_;
  const Grid& grid_;
  const CtOptions& options_;
  Raster raster_;
  phantom::Fill fill_;
  phantom::SolidRays rays_;
  std::array<std::vector<double>, 3> spread_;
  std::vector<double> background_fine_, background_;  ///< slice without bone, the same for all z
};

Volume scan(const Phantom& phantom, const CtOptions& options, Context& context) {
  phantom::check_phantom(phantom, "simulate.ct");
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
      marrow::Random random(context.seed(), i);
      volume.values[i] = std::round(float(volume.values[i] + options.noise_hu * random.normal()));
    }
    context.progress(double(++done) / slabs, "slices");
  });
  return volume;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.ct", scan)
      .summary("Simulates a CT of a bone, sampled from its continuous shape with blur and noise")
      .random()
      .in("phantom", "bone, fracture and fragments")
      .out("volume", "CT in Hounsfield units, rounded to whole numbers")
      .option("spacing_mm", &CtOptions::spacing_mm, "voxel size along x, y, z")
      .option("margin_mm", &CtOptions::margin_mm, "space around the bone", at_least(0))
      .option("range_mm", &CtOptions::range_mm,
              "scans only between these two heights above the bone's distal end; [0, 0]: the whole bone")
      .option("blur_mm", &CtOptions::blur_mm, "standard deviation of the Gaussian point-spread function", at_least(0),
              at_most(3))
      .option("noise_hu", &CtOptions::noise_hu, "standard deviation of the noise", at_least(0), unit("HU"))
      .option("cortical_hu", &CtOptions::cortical_hu, "CT value of compact bone", unit("HU"))
      .option("marrow_hu", &CtOptions::marrow_hu, "CT value of marrow", unit("HU"))
      .option("muscle_hu", &CtOptions::muscle_hu, "CT value of muscle", unit("HU"))
      .option("fat_hu", &CtOptions::fat_hu, "CT value of the fat under the skin", unit("HU"));
}
