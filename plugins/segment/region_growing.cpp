// SPDX-License-Identifier: Apache-2.0
// Seeded region growing (Adams and Bischof, IEEE Trans. Pattern Anal. Mach. Intell. 16, 1994). Of all voxels beside a
// region, the voxel most similar to its region joins first. The regions of all fragments grow at the same time. So the
// voxels between them join last, and a gap that is a little darker than the bone keeps the regions apart.
#include <marrow/plugin.hpp>

#include "marrow/segment/fragments.hpp"

namespace {

using namespace marrow;

struct Options {
  double threshold_hu = 250;
  double floor_hu = 150;
  double band_mm = 4;
};

/// The regions, and the voxels beside them in a queue. The queue is sorted by the difference to the region's mean, in
/// steps of one HU.
class Growth {
 public:
  Growth(const Volume& volume, std::size_t fragments, double threshold_hu)
      : volume_(volume),
        threshold_hu_(threshold_hu),
        owner_(volume.values.size(), segment::kNobody),
        sums_hu_(fragments, 0),
        counts_(fragments, 0),
        waiting_(kSteps) {}

  void claim(std::size_t at, std::uint8_t fragment) {
    if (owner_[at] != segment::kNobody || volume_.values[at] < threshold_hu_) return;
    owner_[at] = fragment;
    sums_hu_[fragment] += volume_.values[at];
    ++counts_[fragment];
    segment::for_neighbours(volume_.grid, at, [&](std::size_t next) { wait(next, fragment); });
  }

  void run(Context& context) {
    for (std::size_t claimed = 0; first_ < kSteps; ++claimed) {
      if (claimed % 1000000 == 0) context.check_cancelled();
      auto& candidates = waiting_[first_];
      if (candidates.empty()) {
        ++first_;
        continue;
      }
      const auto [at, fragment] = candidates.front();
      candidates.pop_front();
      claim(at, fragment);
    }
  }

  bool has_any(std::size_t fragment) const { return counts_[fragment] > 0; }
  const std::vector<std::uint8_t>& owner() const { return owner_; }

 private:
  static constexpr std::size_t kSteps = 4096;
  struct Candidate {
    std::size_t at;
    std::uint8_t fragment;
  };

  void wait(std::size_t at, std::uint8_t fragment) {
    if (owner_[at] != segment::kNobody || volume_.values[at] < threshold_hu_) return;
    const double unlikeness = std::abs(volume_.values[at] - sums_hu_[fragment] / double(counts_[fragment]));
    const std::size_t step = std::min(std::size_t(unlikeness), kSteps - 1);
    waiting_[step].push_back({at, fragment});
    first_ = std::min(first_, step);
  }

  const Volume& volume_;
  double threshold_hu_;
  std::vector<std::uint8_t> owner_;
  std::vector<double> sums_hu_;
  std::vector<std::size_t> counts_;
  std::vector<std::deque<Candidate>> waiting_;
  std::size_t first_ = kSteps;  // all steps before this one are empty
};

List<SignedField> region_growing(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                                 Context& context) {
  check_volume(volume, "volume");
  // Sparse spongy bone may be darker than the bone's surface. Seeds in it are allowed, although they claim no voxel.
  const auto indices = segment::seed_indices(volume, seeds, std::min(options.floor_hu, options.threshold_hu));
  Growth growth(volume, seeds.size(), options.threshold_hu);
  for (std::size_t f = 0; f < indices.size(); ++f)
    for (const Eigen::Vector3d& index : indices[f]) {
      const int x = int(std::lround(index.x())), y = int(std::lround(index.y())), z = int(std::lround(index.z()));
      for (int k = -1; k <= 1; ++k)
        for (int j = -1; j <= 1; ++j)
          for (int i = -1; i <= 1; ++i)
            if (volume.grid.contains(x + i, y + j, z + k))
              growth.claim(volume.grid.offset(x + i, y + j, z + k), std::uint8_t(f));
    }
  growth.run(context);
  std::vector<SignedField> fields;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    context.check_cancelled();
    context.progress(0.4 + 0.6 * double(f) / double(seeds.size()), seeds.name(f));
    if (!growth.has_any(f))
      throw Error(
          formatted("seeds of fragment '{}': none of them lies in bone of {} HU or more that no other fragment has "
                    "taken; add a point in brighter bone, or lower threshold_hu",
                    seeds.name(f), int(options.threshold_hu)));
    if (!seeds[f].wanted) continue;
    const segment::Mask mask =
        segment::solid(volume.grid, growth.owner(), std::uint8_t(f), segment::margin(volume.grid, options.band_mm));
    fields.push_back(segment::field_at_threshold(volume, mask, options.threshold_hu, options.band_mm));
  }
  return segment::list_of(seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.region_growing", region_growing)
      .summary("Regions grow from the seeds of all fragments at once; the most similar voxel joins first")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("threshold_hu", &Options::threshold_hu,
              "darker voxels are not bone; the surface is where the CT crosses this value", unit("HU"))
      .option("floor_hu", &Options::floor_hu,
              "least allowed mean of the voxels around a seed; threshold_hu is used instead if it is lower", unit("HU"))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
