// SPDX-License-Identifier: Apache-2.0
// A simulated case whose fragments are given by seeds, by labels as another program would make them, or by surfaces.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/field/interior.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"

namespace {

using namespace marrow;
using phantom::CaseFolder;

struct Options {
  std::string given_by = "seeds";
  std::vector<double> label_voxel_mm{1.5, 1.5, 1.5};
};

constexpr double kBorder_mm = 5, kMostVoxels = 200e6;

/// A grid around all surfaces. It lies otherwise than that of the CT, as that of another program may.
Grid label_grid(const List<Mesh>& models, const std::vector<double>& voxel_mm) {
  if (voxel_mm.size() != 3)
    throw Error(formatted("label_voxel_mm: expected 3 lengths [x, y, z], got {}", voxel_mm.size()));
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < models.size(); ++i)
    for (const Eigen::Vector3d& vertex : models[i].vertices_mm) box.extend(vertex);
  Grid grid;
  double count = 1;
  for (int k = 0; k < 3; ++k) {
    const double length = voxel_mm[std::size_t(k)];
    if (!(length >= 0.1 && length <= 10))
      throw Error(formatted("label_voxel_mm: expected lengths of 0.1 to 10 mm, got {:f}", length));
    grid.spacing_mm[k] = length;
    grid.size[std::size_t(k)] = int(std::ceil((box.sizes()[k] + 2 * kBorder_mm) / length)) + 1;
    count *= grid.size[std::size_t(k)];
  }
  if (count > kMostVoxels)
    throw Error(
        formatted("label_voxel_mm: the labels would have {:.0f} million voxels, at most 200 are allowed", count / 1e6));
  grid.origin_mm = box.min().array() - kBorder_mm;
  return grid;
}

Volume labels_of(const List<Seeds>& fragments, const List<Mesh>& models, const std::vector<double>& voxel_mm) {
  Volume labels{label_grid(models, voxel_mm), {}};
  labels.values.assign(labels.grid.count(), 0);
  for (std::size_t i = 0; i < fragments.size(); ++i) {
    const SignedField field = field::field_of_mesh(labels.grid, *models.find(fragments.name(i)), 2);
    for (std::size_t k = 0; k < field.values_mm.size(); ++k)
      if (field.values_mm[k] < 0) labels.values[k] = float(i + 1);
  }
  return labels;
}

CaseFolder case_folder(const Case& parts, const List<Mesh>& models, const Options& options) {
  CaseFolder folder{parts, {}, {}};
  if (options.given_by == "seeds") return folder;
  for (const std::string& name : parts.seeds.names()) {
    const Mesh* model = models.find(name);
    if (!model) throw Error("simulate.case_folder: fragment '" + name + "' has no model");
    check_mesh(*model, "simulate.case_folder: model of '" + name + "'");
    if (!is_closed(*model))
      throw Error("simulate.case_folder: the model of '" + name +
                  "' is open, as that of a broken bone, so it has no inside; simulate a whole bone");
    if (options.given_by == "surfaces") folder.surfaces.add(name, *model);
  }
  if (options.given_by == "labels") folder.labels = labels_of(parts.seeds, models, options.label_voxel_mm);
  return folder;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.case_folder", case_folder)
      .summary("A simulated case that gives its fragments by seeds, by labels of another program, or by surfaces")
      .in("case", "case of simulate.case")
      .in("models", "exact surface of each fragment, closed, in CT coordinates", over("fragment"))
      .out("folder", "the case to write: with a label map on a grid of its own, or with surfaces and without CT")
      .option("given_by", &Options::given_by,
              "seeds: points inside; labels: voxels of labels.mha; surfaces: STL files, and no CT",
              one_of({"seeds", "labels", "surfaces"}))
      .option("label_voxel_mm", &Options::label_voxel_mm, "size of a voxel of the labels [x, y, z]");
}
