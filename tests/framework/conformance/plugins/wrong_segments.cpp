// SPDX-License-Identifier: Apache-2.0
// A plain segmenter by region growing, and five that are wrong in one way each: the suite must catch each of them.
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <marrow/plugin.hpp>

namespace {

using marrow::List;
using marrow::Seeds;
using marrow::SignedField;
using marrow::Volume;

enum class Fault { none, fat, swapped, merged, changing, careless };

constexpr float kBone_hu = 800, kSurface_hu = 670, kSlope_hu_per_mm = 1000, kFar_mm = 2;

template <class Visit>
void for_neighbours(const marrow::Grid& grid, int x, int y, int z, const Visit& visit) {
  for (const auto& [dx, dy, dz] : {std::array{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}})
    if (grid.contains(x + dx, y + dy, z + dz)) visit(x + dx, y + dy, z + dz);
}

/// The bright voxels that the seeds reach.
std::vector<bool> grow(const Volume& volume, const Seeds& seeds) {
  std::vector<bool> owned(volume.values.size(), false);
  std::vector<std::array<int, 3>> open;
  const auto add = [&](int x, int y, int z) {
    const std::size_t at = volume.grid.offset(x, y, z);
    if (owned[at] || volume.values[at] < kBone_hu) return;
    owned[at] = true;
    open.push_back({x, y, z});
  };
  for (const Eigen::Vector3d& point : seeds.points_mm) {
    const Eigen::Vector3d index = volume.grid.index_from_point(point);
    if (!index.allFinite() || index.cwiseAbs().maxCoeff() > 1e6)
      throw marrow::Error("a seed of '" + seeds.fragment + "' is no point of the volume");
    const int x = int(std::lround(index.x())), y = int(std::lround(index.y())), z = int(std::lround(index.z()));
    if (volume.grid.contains(x, y, z)) add(x, y, z);
  }
  if (open.empty()) throw marrow::Error("no seed of '" + seeds.fragment + "' is in bone");
  while (!open.empty()) {
    const auto [x, y, z] = open.back();
    open.pop_back();
    for_neighbours(volume.grid, x, y, z, add);
  }
  return owned;
}

/// One voxel more all around, but not along z, where the other fragment lies.
std::vector<bool> fattened(const marrow::Grid& grid, const std::vector<bool>& owned) {
  std::vector<bool> fat = owned;
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x)
        if (owned[grid.offset(x, y, z)])
          for_neighbours(grid, x, y, z,
                         [&](int i, int j, int k) { fat[grid.offset(i, j, k)] = fat[grid.offset(i, j, k)] || k == z; });
  return fat;
}

SignedField field_of(const Volume& volume, const std::vector<bool>& owned) {
  SignedField field{volume.grid, std::vector<float>(owned.size(), kFar_mm)};
  const auto& size = volume.grid.size;
  for (int z = 0; z < size[2]; ++z)
    for (int y = 0; y < size[1]; ++y)
      for (int x = 0; x < size[0]; ++x) {
        const std::size_t at = volume.grid.offset(x, y, z);
        bool beside = false;
        for_neighbours(volume.grid, x, y, z,
                       [&](int i, int j, int k) { beside = beside || owned[volume.grid.offset(i, j, k)]; });
        const float distance = std::clamp((kSurface_hu - volume.values[at]) / kSlope_hu_per_mm, -kFar_mm, kFar_mm);
        if (owned[at])
          field.values_mm[at] = std::min(distance, -0.01f);
        else if (beside)
          field.values_mm[at] = std::max(distance, 0.01f);
      }
  return field;
}

template <Fault fault>
List<SignedField> segment(const Volume& volume, const List<Seeds>& seeds) {
  static std::atomic<int> calls{0};
  marrow::check_volume(volume, "volume");
  if (fault == Fault::careless)
    for (const Seeds& one : seeds)
      if (one.points_mm.empty()) std::abort();
  List<SignedField> fields;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    std::vector<bool> owned = grow(volume, seeds[fault == Fault::swapped ? seeds.size() - 1 - i : i]);
    for (std::size_t j = 0; fault == Fault::merged && j < seeds.size(); ++j) {
      const std::vector<bool> other = grow(volume, seeds[j]);
      for (std::size_t at = 0; at < owned.size(); ++at) owned[at] = owned[at] || other[at];
    }
    if (fault == Fault::fat) owned = fattened(volume.grid, fattened(volume.grid, owned));
    SignedField field = field_of(volume, owned);
    if (fault == Fault::changing) field.values_mm[0] += 0.001f * float(++calls);
    fields.add(seeds.name(i), std::move(field));
  }
  if (fields.empty()) throw marrow::Error("there are no seeds");
  return fields;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("For a test of the suite")
        .in("volume", "CT")
        .in("seeds", "points in each fragment", marrow::over("fragment"))
        .out("field", "signed distances", marrow::over("fragment"));
  };
  add("segment.plain", segment<Fault::none>);
  add("segment.fat", segment<Fault::fat>);
  add("segment.swapped", segment<Fault::swapped>);
  add("segment.merged", segment<Fault::merged>);
  add("segment.changing", segment<Fault::changing>);
  add("segment.careless", segment<Fault::careless>);
}
