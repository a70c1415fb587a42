// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>
#include <queue>

#include "marrow/base/number_text.hpp"
#include "marrow/segment/fragments.hpp"
#include "marrow/segment/seed_points.hpp"

namespace {

using marrow::Context;
using marrow::formatted;
using marrow::Grid;
using marrow::List;
using marrow::Seeds;
using marrow::SignedField;
using marrow::Volume;

struct Options {
  double threshold_hu = 250;
  double floor_hu = 150;
  double band_mm = 4;
};

using marrow::field::kNobody;
constexpr std::uint8_t kUnclaimed = 254;

template <class Visit>
void for_neighbours(const Grid& grid, std::size_t at, const Visit& visit) {
  const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
  const int x = int(at % row), y = int(at % slice / row), z = int(at / slice);
  if (x > 0) visit(at - 1);
  if (x + 1 < grid.size[0]) visit(at + 1);
  if (y > 0) visit(at - row);
  if (y + 1 < grid.size[1]) visit(at + row);
  if (z > 0) visit(at - slice);
  if (z + 1 < grid.size[2]) visit(at + slice);
}

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
      throw marrow::Error(
          formatted("seeds of fragment '{}': at none of them the CT reaches the threshold of {} HU, or it belongs to "
                    "another fragment; add a point in cortical bone, or lower threshold_hu",
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
  const marrow::field::Mask mask =
      marrow::field::solid(volume.grid, owner, fragment, marrow::field::margin(volume.grid, options.band_mm));
  return marrow::field::field_at_threshold(volume, mask, options.threshold_hu, options.band_mm);
}

List<SignedField> threshold(const Volume& volume, const List<Seeds>* seeds, const Options& options, Context& context) {
  marrow::check_volume(volume, "volume");
  std::vector<std::uint8_t> owner(volume.values.size(), kNobody);
  bool any = false;
  for (std::size_t at = 0; at < owner.size(); ++at)
    if (volume.values[at] >= options.threshold_hu) owner[at] = kUnclaimed, any = true;
  if (!any)
    throw marrow::Error(
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
  claim_from_seeds(volume.grid, marrow::field::seed_indices(volume, *seeds, least_hu), owner);
  check_claims(*seeds, options, owner);
  for (std::size_t f = 0; f < seeds->size(); ++f) {
    context.check_cancelled();
    context.progress(double(f) / double(seeds->size()), seeds->name(f));
    if ((*seeds)[f].wanted) fields.push_back(field_of(volume, options, owner, std::uint8_t(f)));
  }
  return marrow::field::list_of(*seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.threshold", threshold)
      .summary("Bone is brighter than a threshold; it is divided between the fragments by the nearest seed")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment; none: the largest connected bone", marrow::over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", marrow::over("fragment"))
      .option("threshold_hu", &Options::threshold_hu, "CT value at the bone's surface", marrow::unit("HU"))
      .option("floor_hu", &Options::floor_hu,
              "least allowed mean of the voxels around a seed; threshold_hu is used instead if it is lower",
              marrow::unit("HU"))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", marrow::at_least(1),
              marrow::at_most(50));
}
