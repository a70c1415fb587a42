// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <queue>

#include "marrow/segment/fragments.hpp"

namespace {

using namespace marrow;

struct Options {
  double threshold_hu = 250;
  double floor_hu = 150;
  double band_mm = 4;
};

using segment::for_neighbours, segment::kNobody;
constexpr std::uint8_t kUnclaimed = 254;

/// Gives each bright voxel to the fragment whose seed reaches it in the fewest steps through bright voxels.
void claim_from_seeds(const Grid& grid, const std::vector<std::vector<Eigen::Vector3d>>& seeds,
                      std::vector<std::uint8_t>& owner) {
  std::queue<std::size_t> reached;
  for (std::size_t f = 0; f < seeds.size(); ++f)
    for (const auto& index : seeds[f]) {
      int low[3], high[3];
      for (int k = 0; k < 3; ++k) {
        const int nearest = int(std::lround(index[k]));
        low[k] = std::max(0, nearest - 1);
        high[k] = std::min(grid.size[k] - 1, nearest + 1);
      }
      for (int z = low[2]; z <= high[2]; ++z)
        for (int y = low[1]; y <= high[1]; ++y)
          for (int x = low[0]; x <= high[0]; ++x) {
            const std::size_t at = grid.offset(x, y, z);
            if (owner[at] != kUnclaimed) continue;
            owner[at] = std::uint8_t(f);
            reached.push(at);
          }
    }
  while (!reached.empty()) {
    const std::size_t at = reached.front();
    reached.pop();
    for_neighbours(grid, at, [&](std::size_t next) {
      if (owner[next] != kUnclaimed) return;
      owner[next] = owner[at];
      reached.push(next);
    });
  }
}

void check_claims(const List<Seeds>& seeds, const Options& options, const std::vector<std::uint8_t>& owner) {
  std::vector<bool> has_bone(256, false);
  for (std::uint8_t fragment : owner) has_bone[fragment] = true;
  for (std::size_t f = 0; f < seeds.size(); ++f)
    if (!has_bone[f])
      throw Error(
          formatted("seeds of fragment '{}': none of them lies in bone of {} HU or more that no other fragment has "
                    "taken; add a point in cortical bone, or lower threshold_hu",
                    seeds.name(f), int(options.threshold_hu)));
}

/// Gives the largest connected component of bright voxels to fragment 0.
void claim_largest(const Grid& grid, std::vector<std::uint8_t>& owner) {
  std::vector<std::size_t> component, largest;
  for (std::size_t start = 0; start < owner.size(); ++start) {
    if (owner[start] != kUnclaimed) continue;
    component.assign(1, start);
    owner[start] = kNobody;
    for (std::size_t i = 0; i < component.size(); ++i)
      for_neighbours(grid, component[i], [&](std::size_t next) {
        if (owner[next] != kUnclaimed) return;
        owner[next] = kNobody;
        component.push_back(next);
      });
    if (component.size() > largest.size()) largest.swap(component);
  }
  for (std::size_t at : largest) owner[at] = 0;
}

SignedField field_of(const Volume& volume, const Options& options, const std::vector<std::uint8_t>& owner,
                     std::uint8_t fragment) {
  const segment::Mask mask =
      segment::solid(volume.grid, owner, fragment, segment::margin(volume.grid, options.band_mm));
  return segment::field_at_threshold(volume, mask, options.threshold_hu, options.band_mm);
}

List<SignedField> threshold(const Volume& volume, const List<Seeds>* seeds, const Options& options, Context& context) {
  check_volume(volume, "volume");
  std::vector<std::uint8_t> owner(volume.values.size(), kNobody);
  bool any = false;
  for (std::size_t at = 0; at < owner.size(); ++at)
    if (volume.values[at] >= options.threshold_hu) owner[at] = kUnclaimed, any = true;
  if (!any)
    throw Error(
        formatted("volume: no voxel reaches the threshold of {} HU, so there is no bone; lower threshold_hu, and check "
                  "that the CT is in Hounsfield units",
                  int(options.threshold_hu)));
  if (!seeds) {
    claim_largest(volume.grid, owner);
    List<SignedField> bone;
    bone.add("bone", field_of(volume, options, owner, 0));
    return bone;
  }
  std::vector<SignedField> fields;
  // Sparse spongy bone may be darker than the bone's surface. Seeds in it are allowed, although they claim no voxel.
  const double least_hu = std::min(options.floor_hu, options.threshold_hu);
  claim_from_seeds(volume.grid, segment::seed_indices(volume, *seeds, least_hu), owner);
  check_claims(*seeds, options, owner);
  for (std::size_t f = 0; f < seeds->size(); ++f) {
    context.check_cancelled();
    context.progress(double(f) / double(seeds->size()), seeds->name(f));
    if ((*seeds)[f].wanted) fields.push_back(field_of(volume, options, owner, std::uint8_t(f)));
  }
  return segment::list_of(*seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.threshold", threshold)
      .summary("Bone is brighter than a threshold; it is divided between the fragments by the nearest seed")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment; none: the largest connected bone", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("threshold_hu", &Options::threshold_hu, "CT value at the bone's surface", unit("HU"))
      .option("floor_hu", &Options::floor_hu,
              "least allowed mean of the voxels around a seed; threshold_hu is used instead if it is lower", unit("HU"))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
