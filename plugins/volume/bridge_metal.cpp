// SPDX-License-Identifier: Apache-2.0
// Metal makes streaks in the slices of a CT that show it. They are worst where a long piece lies within a slice, such
// as a screw across a bone. The rest of the bone's border there misleads every segmentation. A screw is seen in few
// slices, over which a bone hardly changes. So these slices are interpolated from their neighbours. Slices that only a
// plate crosses are kept.
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"

namespace {

using marrow::Context, marrow::Grid, marrow::Volume;

struct Options {
  double metal_hu = 2500;
  double times_median = 1.5;
  double margin_mm = 1.2;
  double longest_mm = 15;
};

/// The metal of a slice: voxels that are metal and whose four neighbours are. So noise does not count.
struct Metal {
  int voxels = 0;
  double across_mm = 0;  ///< diagonal of the box around them
};

Metal metal_of(const Volume& ct, int z, double metal_hu) {
  const Grid& grid = ct.grid;
  const auto is_metal = [&](int x, int y) { return double(ct.at(x, y, z)) > metal_hu; };
  Metal metal;
  Eigen::AlignedBox2d box;
  for (int y = 1; y + 1 < grid.size[1]; ++y)
    for (int x = 1; x + 1 < grid.size[0]; ++x)
      if (is_metal(x, y) && is_metal(x - 1, y) && is_metal(x + 1, y) && is_metal(x, y - 1) && is_metal(x, y + 1)) {
        ++metal.voxels;
        box.extend(Eigen::Vector2d(x * grid.spacing_mm.x(), y * grid.spacing_mm.y()));
      }
  if (metal.voxels > 0) metal.across_mm = box.sizes().norm();
  return metal;
}

/// Metal in only a few consecutive slices is that of screws, so its length counts. Metal in more slices is that of a
/// plate; slices with more metal than usual among them also show a screw.
std::vector<bool> slices_of_long_metal(const Volume& ct, const Options& options) {
  constexpr double kLong_mm = 10;
  const std::size_t slices = std::size_t(ct.grid.size[2]);
  std::vector<Metal> metal;
  for (int z = 0; z < ct.grid.size[2]; ++z) metal.push_back(metal_of(ct, z, options.metal_hu));
  std::vector<bool> is_long(slices, false), is_of_plate(slices, false);
  std::vector<double> with_plate;
  for (std::size_t first = 0, end = 0; first < slices; first = end + 1) {
    for (end = first; end < slices && metal[end].voxels > 0;) ++end;
    const bool has_plate = double(end - first) * ct.grid.spacing_mm.z() > options.longest_mm;
    for (std::size_t z = first; z < end; ++z) {
      is_of_plate[z] = has_plate;
      is_long[z] = !has_plate && metal[z].across_mm > kLong_mm;
      if (has_plate) with_plate.push_back(metal[z].voxels);
    }
  }
  const double usual = with_plate.empty() ? 0 : marrow::quantile_in_place(with_plate, 0.5);
  for (std::size_t z = 0; z < slices; ++z)
    if (is_of_plate[z]) is_long[z] = metal[z].voxels > options.times_median * usual;
  return is_long;
}

/// The slices to replace: those of long metal, and their neighbours.
std::vector<bool> slices_to_replace(const Volume& ct, const Options& options) {
  const int slices = ct.grid.size[2], margin = int(std::ceil(options.margin_mm / ct.grid.spacing_mm.z() - 1e-9));
  const std::vector<bool> is_long = slices_of_long_metal(ct, options);
  std::vector<bool> bad(std::size_t(slices), false);
  for (int z = 0; z < slices; ++z)
    if (is_long[std::size_t(z)])
      std::fill(bad.begin() + std::max(z - margin, 0), bad.begin() + std::min(z + margin + 1, slices), true);
  return bad;
}

/// Interpolates the slices between `below` and `above` linearly.
void bridge(Volume& ct, int below, int above) {
  const std::size_t slice = std::size_t(ct.grid.size[0]) * std::size_t(ct.grid.size[1]);
  const float* low = ct.values.data() + slice * std::size_t(below);
  const float* high = ct.values.data() + slice * std::size_t(above);
  for (int z = below + 1; z < above; ++z) {
    const float part = float(z - below) / float(above - below);
    float* values = ct.values.data() + slice * std::size_t(z);
    for (std::size_t i = 0; i < slice; ++i) values[i] = (1 - part) * low[i] + part * high[i];
  }
}

std::string range(const Grid& grid, int below, int above) {
  const auto height = [&](int z) { return (grid.origin_mm + grid.direction.col(2) * (z * grid.spacing_mm.z())).z(); };
  return marrow::formatted("slices {} to {} (z = {:.1f} to {:.1f} mm)", below + 1, above - 1, height(below + 1),
                           height(above - 1));
}

Volume bridge_metal(const Volume& volume, const Options& options, Context& context) {
  marrow::check_volume(volume, "the CT");
  Volume ct = volume;
  const std::vector<bool> bad = slices_to_replace(volume, options);
  const int slices = volume.grid.size[2];
  for (int z = 0; z < slices; ++z) {
    if (!bad[std::size_t(z)]) continue;
    const int below = z - 1;
    while (z < slices && bad[std::size_t(z)]) ++z;
    const std::string where = range(volume.grid, below, z);
    if (below < 0 || z == slices)
      context.warn(where + " show long metal at the end of the CT, so there is nothing to bridge them from");
    else if ((z - below) * volume.grid.spacing_mm.z() > options.longest_mm)
      context.warn(where + " show long metal over more than longest_mm, so they stay as they are");
    else {
      bridge(ct, below, z);
      context.info(where + " show long metal, and are bridged");
    }
  }
  return ct;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("volume.bridge_metal", bridge_metal)
      .summary("Interpolates slices of a CT that show long metal, such as screws, from their neighbours")
      .in("volume", "CT in Hounsfield units; its slices lie across the third axis of its grid")
      .out("volume", "the CT with these slices interpolated; without metal, the same CT")
      .trait("removes_metal")
      .option("metal_hu", &Options::metal_hu, "metal is above this value", marrow::unit("HU"))
      .option("times_median", &Options::times_median,
              "where metal extends over more than longest_mm, as a plate does: a slice is replaced if it shows this "
              "many times more metal than the median of these slices. Any other slice is replaced if its metal is "
              "longer than 10 mm",
              marrow::at_least(1))
      .option("margin_mm", &Options::margin_mm, "slices nearer than this to such a slice are replaced, too",
              marrow::at_least(0))
      .option("longest_mm", &Options::longest_mm, "longer gaps stay as they are, with a warning", marrow::at_least(0));
}
