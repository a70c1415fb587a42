// SPDX-License-Identifier: Apache-2.0
#pragma once
// Between who owns which voxel and a signed field of each fragment.
#include <array>
#include <cstdint>
#include <vector>

#include "marrow/domain/list.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::field {

constexpr std::uint8_t kNobody = 255;

/// A box of a grid and a byte for each of its voxels; nothing is inside beyond it.
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

/// What a fragment owns, with what it encloses (see fill_interior); the box leaves `margin` voxels around it where the
/// grid has them. Empty for a fragment that owns nothing.
Mask solid(const marrow::Grid& grid, const std::vector<std::uint8_t>& owner, std::uint8_t fragment, int margin = 0);

/// Voxels that leave `band_mm` in any direction.
inline int margin(const marrow::Grid& grid, double band_mm) { return int(band_mm / grid.spacing_mm.minCoeff()) + 2; }

/// The grid of a mask's box.
marrow::Grid grid_of(const marrow::Grid& grid, const Mask& mask);

/// A copy of the values in the mask's box.
std::vector<float> cut_out(const marrow::Volume& volume, const Mask& mask);

/// The field whose values in the mask's box are these, and `outside_mm` elsewhere.
marrow::SignedField paste(const marrow::Grid& grid, const Mask& mask, const std::vector<float>& values_mm,
                          float outside_mm);

/// Signed distances up to `band_mm` to a mask's surface where the CT shows it at `surface_hu`: between voxels that the
/// threshold tells apart, it is where the CT, interpolated, crosses it; elsewhere (against another fragment, across a
/// canal's mouth) halfway between the voxels.
marrow::SignedField field_at_threshold(const marrow::Volume& volume, const Mask& mask, double surface_hu,
                                       double band_mm);

/// The fields of the wanted fragments, which come in the seeds' order; where two overlap each gives up half. Throws
/// Error for none.
marrow::List<marrow::SignedField> list_of(const marrow::List<marrow::Seeds>& seeds,
                                          std::vector<marrow::SignedField> fields);

}  // namespace marrow::field
