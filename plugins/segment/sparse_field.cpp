// SPDX-License-Identifier: Apache-2.0
// ITK's geodesic active contour (Caselles, Kimmel and Sapiro, IJCV 22, 1997) with Whitaker's sparse field (IJCV 29,
// 1998), one contour for each fragment. It starts where the fast expansion from all seeds ended (expansion.hpp). Voxels
// that the expansion gave to another fragment stay outside.
#include <marrow/plugin.hpp>

#include "itk_contour.hpp"
#include "marrow/segment/expansion.hpp"
#include "marrow/segment/fragments.hpp"
#include "marrow/toolbox/field/interior.hpp"

namespace {

using namespace marrow;

struct Options {
  double floor_hu = 150;
  double sigma_mm = 0.5;
  double edge_hu_per_mm = 100;
  double propagation = 0;
  double curvature = 0.2;
  double advection = 1;
  int max_iterations = 60;
  double min_rms = 0.005;
  double band_mm = 4;
};

SignedField field_of(const Volume& volume, const segment::Mask& mask, const std::vector<std::uint8_t>& owner,
                     std::uint8_t fragment, const std::string& name, const Options& options, Context& context) {
  const Grid box = segment::grid_of(volume.grid, mask);
  const float half_voxel_mm = float(box.spacing_mm.minCoeff() / 2);
  std::vector<float> start(mask.is_inside.size());
  for (std::size_t at = 0; at < start.size(); ++at) start[at] = mask.is_inside[at] ? -half_voxel_mm : half_voxel_mm;
  field::march_distances(box, start, options.band_mm);
  const auto& s = box.spacing_mm;
  const segment::Settings settings{options.sigma_mm,  options.edge_hu_per_mm, options.propagation, options.curvature,
                                   options.advection, options.max_iterations, options.min_rms};
  segment::Contour contour =
      segment::geodesic(segment::cut_out(volume, mask), std::move(start), box.size, {s.x(), s.y(), s.z()}, settings);
  const std::string line = formatted("{}: {} iterations, last change {:.4f}", name, contour.iterations, contour.rms);
  context.debug(line);
  for (int z = 0; z < box.size[2]; ++z)
    for (int y = 0; y < box.size[1]; ++y)
      for (int x = 0; x < box.size[0]; ++x) {
        const std::uint8_t here = owner[volume.grid.offset(mask.first[0] + x, mask.first[1] + y, mask.first[2] + z)];
        if (here == fragment || here == segment::kNobody) continue;
        float& value = contour.values[box.offset(x, y, z)];
        value = std::max(value, 0.1f * half_voxel_mm);
      }
  if (std::none_of(contour.values.begin(), contour.values.end(), [](float value) { return value < 0; }))
    throw Error("fragment '" + name + "': its contour vanished; take fewer iterations, or less curvature");
  field::march_distances(box, contour.values, options.band_mm);
  return segment::paste(volume.grid, mask, contour.values, float(options.band_mm));
}

List<SignedField> sparse_field(const Volume& volume, const List<Seeds>& seeds, const Options& options,
                               Context& context) {
  check_volume(volume, "volume");
  for (int size : volume.grid.size)
    if (size < 4) throw Error(formatted("volume: at least 4 voxels along each axis expected, got {}", size));
  const auto owner =
      segment::race(volume, segment::seed_indices(volume, seeds, options.floor_hu), {.floor_hu = options.floor_hu});
  std::vector<SignedField> fields;
  for (std::size_t f = 0; f < seeds.size(); ++f) {
    context.check_cancelled();
    context.progress(double(f) / double(seeds.size()), seeds.name(f));
    const segment::Mask mask =
        segment::solid_of(volume.grid, owner, seeds, f, segment::margin(volume.grid, options.band_mm));
    if (seeds[f].wanted)
      fields.push_back(field_of(volume, mask, owner, std::uint8_t(f), seeds.name(f), options, context));
  }
  return segment::list_of(seeds, std::move(fields));
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.sparse_field", sparse_field)
      .summary("Geodesic active contour on a sparse-field level set (ITK)")
      .in("volume", "CT in Hounsfield units")
      .in("seeds", "points inside each fragment", over("fragment"))
      .out("field", "signed distance to the outer surface of each wanted fragment", over("fragment"))
      .option("floor_hu", &Options::floor_hu,
              "the front from the seeds does not enter voxels below this value; the mean of the voxels around a seed "
              "must not be below it",
              unit("HU"))
      .option("sigma_mm", &Options::sigma_mm,
              "standard deviation of the Gaussian that smooths the CT before its gradient is taken", at_least(0.1),
              at_most(5))
      .option("edge_hu_per_mm", &Options::edge_hu_per_mm, "the speed is halved at this gradient of the CT", at_least(1),
              unit("HU/mm"))
      .option("propagation", &Options::propagation, "weight of the expansion", at_least(-5), at_most(5))
      .option("curvature", &Options::curvature, "weight of the curvature", at_least(0), at_most(5))
      .option("advection", &Options::advection, "weight of the force towards edges", at_least(0), at_most(10))
      .option("max_iterations", &Options::max_iterations, "largest number of iterations", at_least(1))
      .option("min_rms", &Options::min_rms, "stops if the root mean square change of an iteration is below this",
              at_least(0.0001), at_most(1))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
