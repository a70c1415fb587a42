// SPDX-License-Identifier: Apache-2.0
// A CT of the phantom. Rays at most 0.3 mm apart cut the continuous shape. The result is blurred and sampled, and noise
// is added.
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "ct_raster.hpp"
#include "marrow/domain/random.hpp"
#include "marrow/simulate/solid.hpp"
#include "marrow/simulate/streaks.hpp"

namespace {

using namespace marrow;
using phantom::ClutteredPhantom, phantom::Interval, phantom::Phantom, phantom::Raster, phantom::Rectangle;

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
  double slice_thickness_mm = 0;
  double metal_streaks = 1;
};

constexpr double kAirHu = -1000;
constexpr int kSlabSlices = 16;

Grid grid_around(const Phantom& phantom, const CtOptions& options) {
  Eigen::AlignedBox3d box;
  for (const auto& fragment : phantom.fragments)
    for (const auto& vertex : phantom.bone.outer.vertices_mm) box.extend(fragment.ct_from_bone * vertex);
  Eigen::Vector3d low = box.min(), high = box.max();
  const double distal_end = low.z();
  low.array() -= options.margin_mm;
  high.array() += options.margin_mm;
  if (options.range_mm[1] > options.range_mm[0]) {
    low.z() = distal_end + options.range_mm[0];
    high.z() = std::min(high.z(), distal_end + options.range_mm[1]);
  }
  Grid grid;
  for (int k = 0; k < 3; ++k) {
    grid.spacing_mm[k] = options.spacing_mm[std::size_t(k)];
    grid.size[std::size_t(k)] = int(std::floor((high[k] - low[k]) / grid.spacing_mm[k])) + 1;
  }
  grid.origin_mm = low;
  if (!(high.z() > low.z()) || grid.size[2] < 2)
    throw Error(formatted("simulate.ct: range_mm {:f} to {:f} (from the distal end) holds no part of the bone",
                          options.range_mm[0], options.range_mm[1]));
  return grid;
}

std::vector<const phantom::Body*> bodies_in_ct(const std::vector<phantom::Body>& bodies) {
  std::vector<const phantom::Body*> those;
  for (const phantom::Body& body : bodies)
    if (body.in_ct) those.push_back(&body);
  return those;
}

class Scanner {
 public:
  Scanner(const ClutteredPhantom& cluttered, const Grid& grid, const CtOptions& options)
      : cluttered_(cluttered),
        phantom_(cluttered.phantom),
        grid_(grid),
        options_(options),
        raster_(grid, options.blur_mm, options.slice_thickness_mm),
        fill_(phantom_.bone),
        rays_(phantom_, raster_.size[1], raster_.size[2],
              [this](const phantom::Fragment& fragment) {
                return [this, ct_from_bone = fragment.ct_from_bone](const Eigen::Vector3d& point) {
                  const Eigen::Vector3d fine =
                      (ct_from_bone * point - raster_.origin_mm).cwiseQuotient(raster_.spacing_mm);
                  return phantom::RayVertex{fine.y(), fine.z(), fine.x()};
                };
              }),
        // Tissue has no small parts, so it is cut once a slice only.
        tissue_rays_(bodies_in_ct(cluttered.tissues), raster_.size[1], grid.size[2],
                     [this](const phantom::Body& body) {
                       return to_rays(body.ct_from_world, raster_.spacing_mm.x(), raster_.spacing_mm.y(),
                                      grid_.spacing_mm.z(), grid_.origin_mm.z());
                     }),
        body_rays_(bodies_in_ct(cluttered.bodies), raster_.size[1], raster_.size[2], [this](const phantom::Body& body) {
          return to_rays(body.ct_from_world, raster_.spacing_mm.x(), raster_.spacing_mm.y(), raster_.spacing_mm.z(),
                         raster_.origin_mm.z());
        }) {
    for (const phantom::Body* body : bodies_in_ct(cluttered.tissues)) tissue_hu_.push_back(hu_of(*body));
    for (const phantom::Body* body : bodies_in_ct(cluttered.bodies)) body_hu_.push_back(hu_of(*body));
    if (cluttered.tissues.empty()) even_background_ = background();
  }

  /// Computes the slices first to last - 1, without noise.
  void scan(int first, int last, std::vector<float>& values) const {
    const std::size_t slice = std::size_t(grid_.size[0]) * std::size_t(grid_.size[1]);
    const int fine_first = first * raster_.steps[2],
              fine_last = (last - 1) * raster_.steps[2] + 2 * raster_.halo[2] + 1;
    const std::vector<std::vector<double>> backgrounds = backgrounds_of(first, last);
    std::vector<double> sums, blurred(slice, 0.0);
    for (int z = first; z < last; ++z) {
      if (z == first || backgrounds.size() > 1)
        raster_.blur(backgrounds[backgrounds.size() > 1 ? std::size_t(z - first) : 0],
                     {0, raster_.size[0], 0, raster_.size[1]}, blurred);
      sums.insert(sums.end(), blurred.begin(), blurred.end());
    }
    const auto crossings = rays_.bundle().crossings(fine_first, fine_last);
    const auto others = body_rays_.bundle().crossings(fine_first, fine_last);
    std::vector<double> plane(backgrounds[0].size(), 0.0);
    std::size_t next = 0, next_other = 0;
    for (int row = fine_first; row < fine_last; ++row) {
      const auto met = of_row(crossings, row, next), met_others = of_row(others, row, next_other);
      if (met.empty() && met_others.empty()) continue;
      const int nearest =
          std::clamp((row - raster_.halo[2] + raster_.steps[2] / 2) / raster_.steps[2], first, last - 1);
      const std::vector<double>& empty = backgrounds[backgrounds.size() > 1 ? std::size_t(nearest - first) : 0];
      const Rectangle bone = draw(met, met_others, row, empty, plane);
      const Rectangle seen = raster_.blur(plane, bone, blurred);
      for (int z = first; z < last; ++z) {
        const int tap = row - z * raster_.steps[2];
        if (tap < 0 || tap > 2 * raster_.halo[2]) continue;
        const double weight = raster_.spread[2][std::size_t(tap)];
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
    }
    std::copy(sums.begin(), sums.end(), values.begin() + std::ptrdiff_t(slice * std::size_t(first)));
  }

 private:
  double hu_of(const phantom::Body& body) const {
    if (body.material == "fat") return options_.fat_hu;
    if (body.material == "muscle") return options_.muscle_hu;
    if (body.material == "cortical bone") return options_.cortical_hu;
    return phantom::material(body.material).hu;
  }

  phantom::BodyRays::Map to_rays(const RigidTransform& ct_from_world, double dx, double dy, double dz,
                                 double first_z) const {
    return [=, this](const Eigen::Vector3d& point) {
      const Eigen::Vector3d x = ct_from_world * point;
      return phantom::RayVertex{(x.y() - raster_.origin_mm.y()) / dy, (x.z() - first_z) / dz,
                                (x.x() - raster_.origin_mm.x()) / dx};
    };
  }

  static std::span<const phantom::Crossing> of_row(const std::vector<phantom::Crossing>& crossings, int row,
                                                   std::size_t& next) {
    const std::size_t begin = next;
    while (next < crossings.size() && int(crossings[next].row) == row) ++next;
    return {crossings.data() + begin, next - begin};
  }
  static std::span<const phantom::Crossing> of_column(std::span<const phantom::Crossing>& crossings, int column) {
    std::size_t count = 0;
    while (count < crossings.size() && int(crossings[count].column) == column) ++count;
    const auto those = crossings.first(count);
    crossings = crossings.subspan(count);
    return those;
  }

  /// Adds a part of a ray to its bins, as the difference from what `empty` holds there.
  void add(double from, double to, double hu, const double* empty, double* bins, int& x0, int& x1) const {
    const int first = std::max(0, int(std::floor(from + 0.5)));
    const int last = std::min(raster_.size[0] - 1, int(std::floor(to + 0.5)));
    x0 = std::min(x0, first), x1 = std::max(x1, last + 1);
    for (int x = first; x <= last; ++x) {
      const double share = std::min(to, x + 0.5) - std::max(from, x - 0.5);
      bins[x] += std::max(0.0, share) * (hu - empty[x]);
    }
  }

  /// The slices first to last - 1 without bone and bodies, on the fine raster. Only one if all are the same.
  std::vector<std::vector<double>> backgrounds_of(int first, int last) const {
    if (cluttered_.tissues.empty()) return {even_background_};
    const std::size_t width = std::size_t(raster_.size[0]);
    const auto crossings = tissue_rays_.bundle().crossings(first, last);
    std::vector<std::vector<double>> planes(std::size_t(last - first),
                                            std::vector<double>(width * std::size_t(raster_.size[1]), kAirHu));
    std::vector<phantom::BodyInterval> intervals;
    std::vector<double> unused(width, 0.0);
    phantom::for_each_ray(crossings, [&](std::span<const phantom::Crossing> ray) {
      tissue_rays_.intervals(ray, intervals);
      std::stable_sort(intervals.begin(), intervals.end(),
                       [](const auto& a, const auto& b) { return a.body < b.body; });
      double* bins = planes[std::size_t(int(ray.front().row) - first)].data() + ray.front().column * width;
      for (const auto& interval : intervals) {
        std::copy(bins, bins + width, unused.begin());
        int x0 = raster_.size[0], x1 = 0;
        add(interval.from, interval.to, tissue_hu_[std::size_t(interval.body)], unused.data(), bins, x0, x1);
      }
    });
    return planes;
  }

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

  /// Adds the bone in one fine row of rays to the plane, as the difference from the background. Each bin counts by the
  /// length of bone in it. Returns the changed part of the plane.
  Rectangle draw(std::span<const phantom::Crossing> crossings, std::span<const phantom::Crossing> others, int row,
                 const std::vector<double>& background, std::vector<double>& plane) const {
    constexpr int kBoneRank = -1;
    Rectangle touched{raster_.size[0], 0, raster_.size[1], 0};
    std::vector<Interval> intervals;
    std::vector<phantom::BodyInterval> bodies;
    std::vector<phantom::Layer> layers;
    while (!crossings.empty() || !others.empty()) {
      const int y = std::min(crossings.empty() ? raster_.size[1] : int(crossings.front().column),
                             others.empty() ? raster_.size[1] : int(others.front().column));
      rays_.intervals(of_column(crossings, y), intervals);
      body_rays_.intervals(of_column(others, y), bodies);
      double* bins = plane.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      const double* empty = background.data() + std::size_t(y) * std::size_t(raster_.size[0]);
      if (!intervals.empty() || !bodies.empty())
        touched.y0 = std::min(touched.y0, y), touched.y1 = std::max(touched.y1, y + 1);
      if (bodies.empty()) {
        for (const Interval& interval : intervals)
          add(interval.from, interval.to, bone_hu(interval, interval.from, interval.to, y, row), empty, bins,
              touched.x0, touched.x1);
        continue;
      }
      layers.clear();
      for (std::size_t i = 0; i < intervals.size(); ++i)
        layers.push_back({intervals[i].from, intervals[i].to, kBoneRank, i});
      for (const auto& body : bodies) layers.push_back({body.from, body.to, body.body, std::size_t(body.body)});
      phantom::visit_layers(layers, [&](const phantom::Layer& layer, double from, double to) {
        const double hu =
            layer.rank == kBoneRank ? bone_hu(intervals[layer.index], from, to, y, row) : body_hu_[layer.index];
        add(from, to, hu, empty, bins, touched.x0, touched.x1);
      });
    }
    return touched;
  }

  /// The value in the middle of a part of a ray through bone.
  double bone_hu(const Interval& interval, double from, double to, int y, int row) const {
    const auto bone_from_ct = inverse(phantom_.fragments[std::size_t(interval.fragment)].ct_from_bone);
    const double x_ct = raster_.origin_mm.x() + 0.5 * (from + to) * raster_.spacing_mm.x(),
                 z_ct = raster_.origin_mm.z() + row * raster_.spacing_mm.z();
    const Eigen::Vector3d middle =
        bone_from_ct * Eigen::Vector3d(x_ct, raster_.origin_mm.y() + y * raster_.spacing_mm.y(), z_ct);
    const double fraction = interval.cortical ? 1 : fill_.at(middle.z());
    return fraction * options_.cortical_hu + (1 - fraction) * options_.marrow_hu;
  }

  const ClutteredPhantom& cluttered_;
  const Phantom& phantom_;
  const Grid& grid_;
  const CtOptions& options_;
  const Raster raster_;
  phantom::Fill fill_;
  phantom::SolidRays rays_;
  phantom::BodyRays tissue_rays_, body_rays_;
  std::vector<double> tissue_hu_, body_hu_;
  std::vector<double> even_background_;  ///< a slice without bone, if all slices are the same without it
};

Volume cluttered_scan(const ClutteredPhantom& phantom, const CtOptions& options, Context& context) {
  phantom::check_phantom(phantom, "simulate.ct");
  for (double spacing : options.spacing_mm)
    if (!(spacing > 0)) throw Error(formatted("simulate.ct: spacing_mm must be positive, got {:f}", spacing));
  Volume volume;
  volume.grid = grid_around(phantom.phantom, options);
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
  phantom::StreakOptions streaks;
  streaks.strength = options.metal_streaks;
  streaks.blur_mm = options.blur_mm;
  streaks.tissue_centre_mm = phantom.phantom.bone.thigh_centre_mm;
  streaks.tissue_radius_mm = phantom.phantom.bone.thigh_radius_mm;
  phantom::add_metal_streaks(volume, bodies_in_ct(phantom.bodies), streaks, context.seed());
  return volume;
}

Volume scan(const Phantom& phantom, const CtOptions& options, Context& context) {
  return cluttered_scan({phantom, {}, {}}, options, context);
}

/// Declares what both nodes have in common.
void declare(auto&& node) {
  node.random()
      .out("volume", "CT in Hounsfield units, rounded to whole numbers")
      .option("spacing_mm", &CtOptions::spacing_mm, "voxel size along x, y, z")
      .option("margin_mm", &CtOptions::margin_mm, "space around the bone", at_least(0))
      .option("range_mm", &CtOptions::range_mm,
              "scans only between these two heights above the bone's distal end, such as [-100, 200] for a knee; "
              "[0, 0]: the whole bone")
      .option("blur_mm", &CtOptions::blur_mm, "standard deviation of the Gaussian point-spread function", at_least(0),
              at_most(3))
      .option("noise_hu", &CtOptions::noise_hu, "standard deviation of the noise", at_least(0), unit("HU"))
      .option("cortical_hu", &CtOptions::cortical_hu, "CT value of compact bone", unit("HU"))
      .option("marrow_hu", &CtOptions::marrow_hu, "CT value of marrow", unit("HU"))
      .option("muscle_hu", &CtOptions::muscle_hu, "CT value of muscle", unit("HU"))
      .option("fat_hu", &CtOptions::fat_hu, "CT value of the fat under the skin", unit("HU"));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare(plugin.node("simulate.ct", scan)
              .summary("Simulates a CT of a bone, sampled from its continuous shape with blur and noise")
              .in("phantom", "bone, fracture and fragments"));
  declare(plugin.node("simulate.cluttered_ct", cluttered_scan)
              .summary("Simulates a CT like simulate.ct, with the tissues and bodies that are in the patient")
              .in("phantom", "phantom with tissues and bodies")
              .option("slice_thickness_mm", &CtOptions::slice_thickness_mm,
                      "thickness over which a slice is averaged; 0: only the blur", at_least(0), at_most(10))
              .option("metal_streaks", &CtOptions::metal_streaks,
                      "factor of the artefacts of metal; 0: metal is only cut to 3071 HU", at_least(0), at_most(3),
                      unit("")));
}
