// SPDX-License-Identifier: Apache-2.0
#include "marrow/segment/fragments.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/toolbox/field/interior.hpp"

namespace marrow::segment {
namespace {

using marrow::Grid, marrow::SignedField, marrow::Volume;

/// The box around a fragment's voxels, with a margin. Its size is 0 if there are none.
Mask box_of(const Grid& grid, const std::vector<std::uint8_t>& owner, std::uint8_t fragment, int margin) {
  std::array<int, 3> low = grid.size, high{-1, -1, -1};
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y) {
      const std::uint8_t *row = owner.data() + grid.offset(0, y, z), *end = row + grid.size[0];
      const std::uint8_t* first = std::find(row, end, fragment);
      if (first == end) continue;
      const std::uint8_t* last = end - 1;
      while (*last != fragment) --last;
      low = {std::min(low[0], int(first - row)), std::min(low[1], y), std::min(low[2], z)};
      high = {std::max(high[0], int(last - row)), std::max(high[1], y), std::max(high[2], z)};
    }
  Mask box;
  if (high[0] < 0) return box;
  for (int k = 0; k < 3; ++k) {
    box.first[k] = std::max(0, low[k] - margin);
    box.size[k] = std::min(grid.size[k] - 1, high[k] + margin) - box.first[k] + 1;
  }
  return box;
}

template <class Visit>
void for_rows(const Mask& mask, const Visit& visit) {
  for (int z = mask.first[2]; z < mask.first[2] + mask.size[2]; ++z)
    for (int y = mask.first[1]; y < mask.first[1] + mask.size[1]; ++y) visit(y, z);
}

}  // namespace

Mask solid(const Grid& grid, const std::vector<std::uint8_t>& owner, std::uint8_t fragment, int margin) {
  Mask mask = box_of(grid, owner, fragment, margin);
  const Grid box = grid_of(grid, mask);
  mask.is_inside.resize(box.count());
  std::vector<std::uint8_t> is_other(box.count());
  for_rows(mask, [&](int y, int z) {
    const std::uint8_t* row = owner.data() + grid.offset(mask.first[0], y, z);
    const std::size_t at = mask.offset(mask.first[0], y, z);
    for (int x = 0; x < mask.size[0]; ++x) {
      mask.is_inside[at + std::size_t(x)] = row[x] == fragment;
      is_other[at + std::size_t(x)] = row[x] != fragment && row[x] != kNobody;
    }
  });
  if (!mask.empty()) field::fill_interior(box, mask.is_inside, is_other);
  return mask;
}

Mask solid_of(const Grid& grid, const std::vector<std::uint8_t>& owner, const List<Seeds>& seeds, std::size_t fragment,
              int margin) {
  Mask mask = solid(grid, owner, std::uint8_t(fragment), margin);
  if (mask.empty())
    throw Error("seeds of fragment '" + seeds.name(fragment) +
                "': all of them lie where another fragment's seeds are; move them into this fragment's bone");
  return mask;
}

Grid grid_of(const Grid& grid, const Mask& mask) {
  Grid box = grid;
  box.size = mask.size;
  box.origin_mm = grid.point_from_index(Eigen::Vector3d(mask.first[0], mask.first[1], mask.first[2]));
  return box;
}

std::vector<float> cut_out(const Volume& volume, const Mask& mask) {
  std::vector<float> values(mask.is_inside.size());
  for_rows(mask, [&](int y, int z) {
    std::copy_n(volume.values.data() + volume.grid.offset(mask.first[0], y, z), mask.size[0],
                values.data() + mask.offset(mask.first[0], y, z));
  });
  return values;
}

SignedField paste(const Grid& grid, const Mask& mask, const std::vector<float>& values_mm, float outside_mm) {
  SignedField field{grid, std::vector<float>(grid.count(), outside_mm)};
  for_rows(mask, [&](int y, int z) {
    std::copy_n(values_mm.data() + mask.offset(mask.first[0], y, z), mask.size[0],
                field.values_mm.data() + grid.offset(mask.first[0], y, z));
  });
  return field;
}

SignedField field_at_threshold(const Volume& volume, const Mask& mask, double surface_hu, double band_mm) {
  const Grid& grid = volume.grid;
  std::vector<float> values(mask.is_inside.size());
  const double half_voxel_mm = grid.spacing_mm.minCoeff() / 2;
  for_rows(mask, [&](int y, int z) {
    for (int x = mask.first[0]; x < mask.first[0] + mask.size[0]; ++x) {
      const bool inside = mask.at(x, y, z);
      bool at_surface = false;
      double squared_steepness = 0;
      for (int k = 0; k < 3; ++k) {
        int before[3] = {x, y, z}, after[3] = {x, y, z};
        before[k] = std::max(before[k] - 1, 0);
        after[k] = std::min(after[k] + 1, grid.size[k] - 1);
        at_surface |=
            mask.at(before[0], before[1], before[2]) != inside || mask.at(after[0], after[1], after[2]) != inside;
        const double rise =
            double(volume.at(after[0], after[1], after[2])) - double(volume.at(before[0], before[1], before[2]));
        squared_steepness += std::pow(rise / (2 * grid.spacing_mm[k]), 2);
      }
      const double hu = volume.at(x, y, z);
      double distance = half_voxel_mm;
      if (at_surface && (hu >= surface_hu) == inside)
        distance = std::abs(hu - surface_hu) / std::max(std::sqrt(squared_steepness), 1.0);
      distance = std::clamp(distance, 1e-4, grid.spacing_mm.maxCoeff());
      values[mask.offset(x, y, z)] = float(inside ? -distance : distance);
    }
  });
  field::march_distances(grid_of(grid, mask), values, band_mm);
  return paste(grid, mask, values, float(band_mm));
}

marrow::List<SignedField> list_of(const marrow::List<marrow::Seeds>& seeds, std::vector<SignedField> fields) {
  if (fields.empty()) throw marrow::Error("seeds: no fragment is wanted; set wanted: true for at least one");
  for (std::size_t a = 0; a < fields.size(); ++a)
    for (std::size_t b = a + 1; b < fields.size(); ++b)
      for (std::size_t at = 0; at < fields[a].values_mm.size(); ++at) {
        float &of_a = fields[a].values_mm[at], &of_b = fields[b].values_mm[at];
        const float overlap = std::min(0.f, 0.5f * (of_a + of_b));
        of_a -= overlap;
        of_b -= overlap;
      }
  marrow::List<SignedField> list;
  std::size_t next = 0;
  for (std::size_t f = 0; f < seeds.size(); ++f)
    if (seeds[f].wanted) list.add(seeds.name(f), std::move(fields.at(next++)));
  return list;
}

}  // namespace marrow::segment
