// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::segment {

constexpr std::size_t kMostFragments = 253;  // one byte says who owns a voxel

/// The seeds of each fragment as fractional indices. Throws Error if there are no fragments or more than
/// kMostFragments, if a fragment has no seed, if a seed lies outside the volume, or if the mean of the 3 x 3 x 3 voxels
/// around a seed is below `least_hu`.
inline std::vector<std::vector<Eigen::Vector3d>> seed_indices(const marrow::Volume& volume,
                                                              const marrow::List<marrow::Seeds>& seeds,
                                                              double least_hu) {
  using marrow::Error;
  if (seeds.empty())
    throw Error(
        "seeds: there are none; give at least one fragment with one point inside its bone (seeds in case.yaml)");
  if (seeds.size() > kMostFragments)
    throw Error(formatted("seeds: at most {} fragments expected, got {}", kMostFragments, seeds.size()));
  std::vector<std::vector<Eigen::Vector3d>> indices(seeds.size());
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    const std::string fragment = "seeds of fragment '" + seeds.name(f) + "'";
    if (seeds[f].points_mm.empty()) throw Error(fragment + ": there are none; give at least one point inside its bone");
    for (std::size_t i = 0; i < seeds[f].points_mm.size(); ++i) {
      const Eigen::Vector3d& point = seeds[f].points_mm[i];
      const std::string where =
          formatted(": point {} at ({:.1f}, {:.1f}, {:.1f}) mm", i + 1, point.x(), point.y(), point.z());
      const Eigen::Vector3d index = volume.grid.index_from_point(point);
      int voxel[3];
      for (int k = 0; k < 3; ++k) {
        if (!(index[k] >= 0 && index[k] <= volume.grid.size[k] - 1))
          throw Error(fragment + where + " lies outside the volume; seeds are points of the CT's frame '" +
                      volume.grid.frame + "' in mm");
        voxel[k] = int(std::lround(index[k]));
      }
      double sum = 0, count = 0;
      for (int z = voxel[2] - 1; z <= voxel[2] + 1; ++z)
        for (int y = voxel[1] - 1; y <= voxel[1] + 1; ++y)
          for (int x = voxel[0] - 1; x <= voxel[0] + 1; ++x)
            if (volume.grid.contains(x, y, z)) sum += volume.at(x, y, z), ++count;
      if (sum / count < least_hu) {
        const std::string value = formatted(
            " is not in bone: the CT shows {:.0f} HU there, at least {:.0f} HU expected; move it into cortical or "
            "spongy bone",
            sum / count, least_hu);
        throw Error(fragment + where + value);
      }
      indices[f].push_back(index);
    }
  }
  return indices;
}

}  // namespace marrow::segment
