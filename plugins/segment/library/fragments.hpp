// SPDX-License-Identifier: Apache-2.0
#pragma once
// Makes a signed field of each fragment from a map that says which fragment owns each voxel.
#include <cstdint>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::segment {

constexpr std::uint8_t kNobody = 255;

/// A box of voxels in a grid, with one byte for each voxel. A voxel beyond the box is outside.
struct Mask {
  std::array<int, 3> first{}, size{};
  std::vector<std::uint8_t> is_inside;

  bool empty() const { return is_inside.empty(); }
  std::size_t offset(int x, int y, int z) const {
    return (std::size_t(z - first[2]) * size[1] + std::size_t(y - first[1])) * size[0] + std::size_t(x - first[0]);
  }
  bool contains(int x, int y, int z) const {
    return x >= first[0] && y >= first[1] && z >= first[2] && x < first[0] + size[0] && y < first[1] + size[1] &&
           z < first[2] + size[2];
  }
  bool at(int x, int y, int z) const { return contains(x, y, z) && is_inside[offset(x, y, z)]; }
};

/// The voxels that a fragment owns and those that it encloses (see fill_interior). The box has `margin` more voxels on
/// each side, as far as the grid goes. The mask is empty if the fragment owns nothing.
Mask solid(const marrow::Grid& grid, const std::vector<std::uint8_t>& owner, std::uint8_t fragment, int margin = 0);

/// solid() of a fragment with seeds. Throws Error if it owns nothing.
Mask solid_of(const marrow::Grid& grid, const std::vector<std::uint8_t>& owner,
              const marrow::List<marrow::Seeds>& seeds, std::size_t fragment, int margin = 0);

/// Margin in voxels that contains a band of `band_mm` in every direction.
inline int margin(const marrow::Grid& grid, double band_mm) { return int(band_mm / grid.spacing_mm.minCoeff()) + 2; }

/// Calls visit(place) for the six neighbours of a voxel that lie in the grid.
template <class Visit>
void for_neighbours(const marrow::Grid& grid, std::size_t at, const Visit& visit) {
  const std::size_t row = std::size_t(grid.size[0]), slice = row * grid.size[1];
  const int x = int(at % row), y = int(at % slice / row), z = int(at / slice);
  if (x > 0) visit(at - 1);
  if (x + 1 < grid.size[0]) visit(at + 1);
  if (y > 0) visit(at - row);
  if (y + 1 < grid.size[1]) visit(at + row);
  if (z > 0) visit(at - slice);
  if (z + 1 < grid.size[2]) visit(at + slice);
}

/// The grid of a mask's box.
marrow::Grid grid_of(const marrow::Grid& grid, const Mask& mask);

/// A copy of the values in the mask's box.
std::vector<float> cut_out(const marrow::Volume& volume, const Mask& mask);

/// The field on the whole grid with these values in the mask's box and `outside_mm` elsewhere.
marrow::SignedField paste(const marrow::Grid& grid, const Mask& mask, const std::vector<float>& values_mm,
                          float outside_mm);

/// Signed distances in mm, up to `band_mm`, to the surface of a mask. A voxel beside the surface gets its distance from
/// the CT's value and gradient if the threshold `surface_hu` puts it on the same side as the mask. Otherwise (against
/// another fragment, across the mouth of a canal) the surface lies half a voxel away.
marrow::SignedField field_at_threshold(const marrow::Volume& volume, const Mask& mask, double surface_hu,
                                       double band_mm);

/// Names the fields by their fragments. `fields`: one for each wanted fragment, in the order of the seeds, all on one
/// grid. Where two fragments overlap, each gives up half of the overlap. Throws Error if there are no fields.
marrow::List<marrow::SignedField> list_of(const marrow::List<marrow::Seeds>& seeds,
                                          std::vector<marrow::SignedField> fields);

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
