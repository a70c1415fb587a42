// SPDX-License-Identifier: Apache-2.0
// Overlap of two segmentations (Dice, Ecology 1945). They may have different grids: the reference is interpolated at
// the voxels of the field.
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

void check_field(const SignedField& field, const std::string& what) {
  check_volume({field.grid, field.values_mm}, what);
}

double voxel_mm3(const Grid& grid) { return grid.spacing_mm.prod(); }

/// Whether a point lies in one of the grid's voxels.
bool covers(const Grid& grid, const Eigen::Vector3d& index) {
  for (int k = 0; k < 3; ++k)
    if (!(index[k] >= -0.5 && index[k] <= grid.size[std::size_t(k)] - 0.5)) return false;
  return true;
}

/// Calls visit(whether the sample is inside, its index in the other grid) for each sample.
template <class Visit>
void for_samples(const SignedField& field, const Grid& other, const Visit& visit) {
  for (int z = 0; z < field.grid.size[2]; ++z)
    for (int y = 0; y < field.grid.size[1]; ++y)
      for (int x = 0; x < field.grid.size[0]; ++x)
        visit(field.at(x, y, z) < 0,
              other.index_from_point(field.grid.point_from_index({double(x), double(y), double(z)})));
}

Metrics dice(const SignedField& field, const SignedField& reference, Context& context) {
  check_field(field, "field");
  check_field(reference, "reference");
  if (field.grid.frame != reference.grid.frame)
    throw Error("the field is in the frame '" + field.grid.frame + "', but the reference in '" + reference.grid.frame +
                "'; compare segmentations of the same CT");
  std::size_t inside = 0, of_reference = 0, both = 0, beyond = 0;
  for_samples(field, reference.grid, [&](bool is_inside, const Eigen::Vector3d& index) {
    const bool is_other =
        covers(reference.grid, index) && sample_trilinear(reference.grid, reference.values_mm, index) < 0;
    inside += is_inside;
    of_reference += is_other;
    both += is_inside && is_other;
  });
  for_samples(reference, field.grid,
              [&](bool is_inside, const Eigen::Vector3d& index) { beyond += is_inside && !covers(field.grid, index); });
  const double volume = double(inside) * voxel_mm3(field.grid), common = double(both) * voxel_mm3(field.grid),
               other = double(of_reference) * voxel_mm3(field.grid) + double(beyond) * voxel_mm3(reference.grid);
  if (volume + other == 0)
    throw Error(
        "neither the field nor the reference has an inside, so there is nothing to compare; inside is where values are "
        "negative");
  if (beyond > 0)
    context.warn(formatted("{} voxels of the reference lie outside the field's grid and count as missed", beyond));
  Metrics metrics;
  metrics.items = {{"dice", 2 * common / (volume + other), ""},
                   {"jaccard", common / (volume + other - common), ""},
                   {"volume_mm3", volume, "mm3"},
                   {"reference_mm3", other, "mm3"}};
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.dice", dice)
      .summary("Overlap of two segmentations: Dice's and Jaccard's coefficients")
      .in("field", "segmentation, negative inside")
      .in("reference", "segmentation to compare with; it is interpolated at the voxels of the field")
      .out("metrics",
           "Dice = 2 |A and B| / (|A| + |B|), Jaccard = |A and B| / |A or B|, and both volumes; parts of the reference "
           "beyond the field's grid count as missed")
      .figures({"dice", "jaccard", "volume_mm3", "reference_mm3"});
}
