// SPDX-License-Identifier: Apache-2.0
// The fragments of a case, however they are given: segmented here from seeds, by the labels of another program, or as a
// surface. What comes after needs only their fields.
#include <tbb/parallel_for.h>

#include <marrow/plugin.hpp>

#include "marrow/toolbox/field/binary_surface.hpp"
#include "marrow/toolbox/field/interior.hpp"

namespace {

using namespace marrow;
using Eigen::Vector3d;

struct Options {
  double band_mm = 4;
};

/// Without a CT, a surface gets voxels of this size, or larger ones if there would be too many.
constexpr double kFinest_mm = 0.5, kMostVoxels = 20e6;

/// The field on the CT's grid. Beyond its own grid, where its bone cannot be, it is at its greatest.
SignedField on_grid(const SignedField& field, const Grid& grid, double band_mm) {
  SignedField moved{grid, std::vector<float>(grid.count(), float(band_mm))};
  tbb::parallel_for(0, grid.size[2], [&](int z) {
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x) {
        const Vector3d index = field.grid.index_from_point(grid.point_from_index(Vector3d(x, y, z)));
        bool is_inside = true;
        for (int k = 0; k < 3; ++k) is_inside &= index[k] >= 0 && index[k] <= field.grid.size[std::size_t(k)] - 1;
        if (is_inside) moved.values_mm[grid.offset(x, y, z)] = sample_trilinear(field.grid, field.values_mm, index);
      }
  });
  return moved;
}

/// A grid around a surface, for want of a CT.
Grid grid_around(const Mesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vector3d& vertex : mesh.vertices_mm) box.extend(vertex);
  const double spacing = std::max(kFinest_mm, std::cbrt(box.volume() / kMostVoxels));
  Grid grid;
  grid.frame = mesh.frame;
  grid.spacing_mm.setConstant(spacing);
  grid.origin_mm = box.min().array() - 3 * spacing;
  for (int k = 0; k < 3; ++k) grid.size[std::size_t(k)] = int(std::ceil(box.sizes()[k] / spacing)) + 7;
  return grid;
}

SignedField field_of_surface(const Mesh& surface, const std::string& fragment, const Volume* volume, double band_mm) {
  check_mesh(surface, "surface of '" + fragment + "'");
  if (!is_closed(surface))
    throw Error("the surface of '" + fragment + "' is open, so it has no inside; close its holes");
  return field::field_of_mesh(volume ? volume->grid : grid_around(surface), surface, band_mm);
}

SignedField field_of_label(const Volume& mask, const Volume* volume, double band_mm) {
  const SignedField field = field::field_of_mask(mask, band_mm);
  return volume ? on_grid(field, volume->grid, band_mm) : field;
}

/// Throws Error if the fragment lies beside the CT.
void check_meets(const SignedField& field, const std::string& fragment) {
  if (std::any_of(field.values_mm.begin(), field.values_mm.end(), [](float value) { return value < 0; })) return;
  throw Error("fragment '" + fragment +
              "' has no voxel of the CT: its label or surface lies elsewhere. Were they made from another scan, or is "
              "the surface in another unit or frame (RAS)?");
}

List<SignedField> given(const Volume* volume, const List<SignedField>* segmented, const List<Volume>* label,
                        const List<Mesh>* surface, const Options& options) {
  if (volume) check_volume(*volume, "volume");
  const auto has = [](const auto* list) { return list && !list->empty(); };
  if (has(label) && has(surface)) throw Error("a fragment is given by a label or by a surface; got both");
  if (!has(label) && !has(surface)) {
    if (has(segmented)) return *segmented;
    throw Error("nothing gives the fragments: neither a segmentation from seeds nor labels nor surfaces");
  }
  List<SignedField> fields;
  const auto add = [&](const std::string& name, SignedField field) {
    check_meets(field, name);
    fields.add(name, std::move(field));
  };
  for (std::size_t i = 0; has(label) && i < label->size(); ++i)
    add(label->name(i), field_of_label((*label)[i], volume, options.band_mm));
  for (std::size_t i = 0; has(surface) && i < surface->size(); ++i)
    add(surface->name(i), field_of_surface((*surface)[i], surface->name(i), volume, options.band_mm));
  return fields;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("segment.given", given)
      .summary("The fragments as a case gives them: segmented from seeds, by labels of another program, or as surfaces")
      .in("volume", "CT in Hounsfield units; without it, each field lies on a grid of its own")
      .in("segmented", "fields of another segmentation, passed on as they are if there is neither label nor surface",
          over("fragment"))
      .in("label", "mask of each fragment: 1 inside, 0 outside; its surface is smooth and lies between the voxels",
          over("fragment"))
      .in("surface", "closed surface of each fragment, in mm", over("fragment"))
      .out("field", "signed distance to the fragment's surface, on the CT's grid if there is one", over("fragment"))
      .option("band_mm", &Options::band_mm, "larger distances are clamped to this", at_least(1), at_most(50));
}
