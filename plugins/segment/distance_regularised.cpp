// SPDX-License-Identifier: Apache-2.0
// A level set that regularises its own distance function: Li, Xu, Gui and Fox, Distance regularized level set evolution
// and its application to image segmentation, IEEE Trans. Image Process. 19, 2010 (after Li, Xu, Gui and Fox, CVPR
// 2005). Its evolution (their Eq 30):
//   d phi / dt = mu div(d_p(|grad phi|) grad phi) + lambda delta(phi) div(g grad phi / |grad phi|) + alpha g delta(phi)
// with d_p from the double-well potential (their Eq 16), g = 1 / (1 + |grad G * I|^2 / K^2) and phi negative inside.
// The distance function is never re-initialised. As in the paper, phi starts as a step function. Here its inside is
// what the front from the fragment's seeds reaches (expansion.hpp), with everything that it encloses.
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "marrow/segment/expansion.hpp"
#include "marrow/segment/fragments.hpp"
#include "marrow/toolbox/field/interior.hpp"

namespace {

using namespace marrow;

struct Options {
  double floor_hu = 150;
  double sigma_mm = 0.5;
  double edge_hu_per_mm = 100;
  double regularity = 0.1;
  double length = 1;
  double area = 0;
  int iterations = 80;
  double band_mm = 4;
};

constexpr float kStart = 2, kDiracWidth = 1.5;  // c0 and epsilon of the paper, in voxels of the finest spacing
constexpr int kReach = 4;  // half the width of the narrow band, in voxels; beyond it phi stays constant
constexpr int kStepsPerBand = 5;

/// d_p(s) = p'(s) / s of the double-well potential. Its minima are at |grad phi| = 0 and 1.
float diffusion(float s) {
  if (s < 1e-6f) return 1;
  return s <= 1 ? std::sin(2 * float(M_PI) * s) / (2 * float(M_PI) * s) : (s - 1) / s;
}

float dirac(float value) {
  return std::abs(value) > kDiracWidth ? 0.f : (1 + std::cos(float(M_PI) * value / kDiracWidth)) / (2 * kDiracWidth);
}

/// phi of one fragment in a box around it, in units of the finest voxel spacing.
class Evolution {
 public:
  Evolution(const Volume& volume, const segment::Mask& mask, const std::vector<std::uint8_t>& owner,
            std::uint8_t fragment, const Options& options)
      : options_(options), size_(mask.size), phi_(mask.is_inside.size()), is_foreign_(mask.is_inside.size()) {
    const Grid& grid = volume.grid;
    const double finest = grid.spacing_mm.minCoeff();
    for (int k = 0; k < 3; ++k) per_step_[k] = float(finest / grid.spacing_mm[k]);
    steps_ = {1, size_[0], std::ptrdiff_t(size_[0]) * size_[1]};
    for (int z = 0; z < size_[2]; ++z)
      for (int y = 0; y < size_[1]; ++y)
        for (int x = 0; x < size_[0]; ++x) {
          const std::size_t at = std::size_t(z) * steps_[2] + std::size_t(y) * steps_[1] + std::size_t(x);
          const std::uint8_t here = owner[grid.offset(mask.first[0] + x, mask.first[1] + y, mask.first[2] + z)];
          phi_[at] = mask.is_inside[at] ? -kStart : kStart;
          is_foreign_[at] = here != fragment && here != segment::kNobody;
        }
    make_indicator(segment::cut_out(volume, mask), grid.spacing_mm);
  }

  void run(Context& context) {
    for (int step = 0; step < options_.iterations; ++step) {
      context.check_cancelled();
      if (step % kStepsPerBand == 0) choose_band();
      advance();
    }
  }
  const std::vector<float>& phi() const { return phi_; }

 private:
  /// Computes g from the gradient of the smoothed CT.
  void make_indicator(std::vector<float> hu, const Eigen::Vector3d& spacing_mm) {
    for (int k = 0; k < 3; ++k) smooth(hu, k, options_.sigma_mm / spacing_mm[k]);
    indicator_.resize(hu.size());
    for_interior([&](std::size_t at) {
      float squared = 0;
      for (int k = 0; k < 3; ++k)
        squared += float(std::pow((hu[at + steps_[k]] - hu[at - steps_[k]]) / (2 * spacing_mm[k]), 2));
      indicator_[at] = 1 / (1 + squared / float(options_.edge_hu_per_mm * options_.edge_hu_per_mm));
    });
  }

  void smooth(std::vector<float>& values, int axis, double sigma) const {
    const int reach = int(std::ceil(3 * sigma));
    std::vector<float> weights;
    float sum = 0;
    for (int k = -reach; k <= reach; ++k)
      weights.push_back(float(std::exp(-0.5 * k * k / (sigma * sigma)))), sum += weights.back();
    const std::vector<float> before = values;
    tbb::parallel_for(0, size_[2], [&](int z) {
      for (int y = 0; y < size_[1]; ++y)
        for (int x = 0; x < size_[0]; ++x) {
          const int place[3] = {x, y, z};
          const std::ptrdiff_t at = z * steps_[2] + y * steps_[1] + x;
          float total = 0;
          for (int k = -reach; k <= reach; ++k)
            total += weights[std::size_t(k + reach)] *
                     before[std::size_t(at + (std::clamp(place[axis] + k, 0, size_[axis] - 1) - place[axis]) *
                                                 steps_[axis])];
          values[std::size_t(at)] = total / sum;
        }
    });
  }

  /// Calls visit(place) for each voxel that has neighbours on all sides.
  template <class Visit>
  void for_interior(const Visit& visit) const {
    tbb::parallel_for(1, std::max(1, size_[2] - 1), [&](int z) {
      for (int y = 1; y < size_[1] - 1; ++y)
        for (int x = 1; x < size_[0] - 1; ++x)
          visit(std::size_t(z) * steps_[2] + std::size_t(y) * steps_[1] + std::size_t(x));
    });
  }

  /// The band: all voxels within kReach voxels of the zero level.
  void choose_band() {
    std::vector<std::uint8_t> is_near(phi_.size(), 0);
    for_interior([&](std::size_t at) {
      for (int k = 0; k < 3; ++k)
        if ((phi_[at + steps_[k]] < 0) != (phi_[at] < 0) || (phi_[at - steps_[k]] < 0) != (phi_[at] < 0))
          is_near[at] = 1;
    });
    for (int k = 0; k < 3; ++k) {
      const std::vector<std::uint8_t> before = is_near;
      for (std::ptrdiff_t at = kReach * steps_[k]; at < std::ptrdiff_t(phi_.size()) - kReach * steps_[k]; ++at)
        for (int i = -kReach; i <= kReach && !is_near[at]; ++i) is_near[at] = before[at + i * steps_[k]];
    }
    band_.clear();
    for (int z = 2; z < size_[2] - 2; ++z)
      for (int y = 2; y < size_[1] - 2; ++y)
        for (int x = 2; x < size_[0] - 2; ++x) {
          const std::size_t at = std::size_t(z) * steps_[2] + std::size_t(y) * steps_[1] + std::size_t(x);
          if (is_near[at]) band_.push_back(std::uint32_t(at));
        }
    next_.resize(band_.size());
  }

  Eigen::Vector3f gradient(std::size_t at) const {
    return {(phi_[at + 1] - phi_[at - 1]) * 0.5f * per_step_[0],
            (phi_[at + steps_[1]] - phi_[at - steps_[1]]) * 0.5f * per_step_[1],
            (phi_[at + steps_[2]] - phi_[at - steps_[2]]) * 0.5f * per_step_[2]};
  }

  void advance() {
    constexpr float kStep = 1;  // regularity * step is below 1/6, so the diffusion is stable in 3D
    tbb::parallel_for(std::size_t(0), band_.size(), [&](std::size_t i) {
      const std::size_t at = band_[i];
      const float delta = dirac(phi_[at]);
      float regular = 0, edge = 0;
      // Both divergences are sums of the flows to the six neighbouring voxels.
      for (int k = 0; k < 3; ++k)
        for (const int side : {-1, 1}) {
          const std::size_t beside = std::size_t(std::ptrdiff_t(at) + side * steps_[k]);
          const Eigen::Vector3f slope = gradient(beside);
          const float length = slope.norm();
          // The flow goes through the face between both voxels, so the derivative across the face is a simple
          // difference.
          const float across = float(side) * (phi_[beside] - phi_[at]) * per_step_[k];
          const float face_length = std::max(0.5f * (length + gradient(at).norm()), 1e-3f);
          regular += float(side) * diffusion(face_length) * across * per_step_[k];
          if (delta > 0)
            edge += float(side) * 0.5f * (indicator_[at] + indicator_[beside]) * across / face_length * per_step_[k];
        }
      const float change = float(options_.regularity) * regular +
                           delta * (float(options_.length) * edge + float(options_.area) * indicator_[at]);
      next_[i] = std::clamp(phi_[at] + kStep * change, -2 * kStart, 2 * kStart);
    });
    for (std::size_t i = 0; i < band_.size(); ++i)
      phi_[band_[i]] = is_foreign_[band_[i]] ? std::max(next_[i], 0.05f) : next_[i];
  }

  const Options& options_;
  std::array<int, 3> size_;
  std::array<std::ptrdiff_t, 3> steps_{};
  std::array<float, 3> per_step_{};
  std::vector<float> phi_, indicator_, next_;
  std::vector<std::uint8_t> is_foreign_;
  std::vector<std::uint32_t> band_;
};

List<SignedField> distance_regularised(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                                       Context& context) {
  check_volume(volume, "volume");
  const auto owner =
      segment::race(volume, segment::seed_indices(volume, seeds, options.floor_hu), {.floor_hu = options.floor_hu});
  std::vector<SignedField> fields;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    context.progress(double(f) / double(seeds.size()), seeds.name(f));
    const segment::Mask mask =
        segment::solid_of(volume.grid, owner, seeds, f, segment::margin(volume.grid, options.band_mm) + kReach);
    if (!seeds[f].wanted) continue;
    Evolution evolution(volume, mask, owner, std::uint8_t(f), options);
    evolution.run(context);
    std::vector<float> values = evolution.phi();
    for (float& value : values) value *= float(volume.grid.spacing_mm.minCoeff());
    if (std::none_of(values.begin(), values.end(), [](float value) { return value < 0; }))
      throw Error("fragment '" + seeds.name(f) + "': its level set vanished; take fewer steps, or a lower area weight");
    field::march_distances(segment::grid_of(volume.grid, mask), values, options.band_mm);
    fields.push_back(segment::paste(volume.grid, mask, values, float(options.band_mm)));
  }
  return segment::list_of(seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.distance_regularised", distance_regularised)
      .summary("Level set with distance regularisation (DRLSE: Li et al. 2010), without re-initialisation")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("floor_hu", &Options::floor_hu,
              "the front from the seeds does not enter voxels below this value; the mean of the voxels around a seed "
              "must not be below it",
              unit("HU"))
      .option("sigma_mm", &Options::sigma_mm,
              "standard deviation of the Gaussian that smooths the CT before its gradient is taken", at_least(0.1),
              at_most(5))
      .option("edge_hu_per_mm", &Options::edge_hu_per_mm, "K: at this gradient of the CT, g is 1/2", at_least(1),
              unit("HU/mm"))
      .option("regularity", &Options::regularity, "mu: weight of the distance regularisation", at_least(0.01),
              at_most(0.16))
      .option("length", &Options::length,
              "lambda: weight of the length term, which smooths the surface and draws it to edges", at_least(0),
              at_most(5))
      .option("area", &Options::area, "alpha: weight of the area term; positive shrinks the body, negative expands it",
              at_least(-2), at_most(2))
      .option("iterations", &Options::iterations, "number of time steps", at_least(0))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
