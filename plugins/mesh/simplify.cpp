// SPDX-License-Identifier: Apache-2.0
#include <vtkQuadricDecimation.h>

#include <marrow/plugin.hpp>

#include "marrow/toolbox/vtk/poly_data.hpp"

namespace {

struct Options {
  int triangles = 20000;
};

marrow::Mesh simplify(const marrow::Mesh& mesh, const Options& options) {
  marrow::check_mesh(mesh, "mesh to simplify");
  if (mesh.triangles.size() <= std::size_t(options.triangles)) return mesh;
  vtkNew<vtkQuadricDecimation> filter;
  filter->SetInputData(marrow::vtk::poly_data(mesh));
  filter->SetTargetReduction(1.0 - double(options.triangles) / double(mesh.triangles.size()));
  filter->VolumePreservationOn();
  filter->Update();
  vtkPolyData* surface = filter->GetOutput();

  marrow::Mesh result;
  result.frame = mesh.frame;
  for (vtkIdType v = 0; v < surface->GetNumberOfPoints(); ++v) result.vertices_mm.emplace_back(surface->GetPoint(v));
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  for (surface->GetPolys()->InitTraversal(); surface->GetPolys()->GetNextCell(count, corners);)
    result.triangles.push_back({std::uint32_t(corners[0]), std::uint32_t(corners[1]), std::uint32_t(corners[2])});
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.simplify", simplify)
      .summary(
          "Reduces the number of triangles for display, by quadric error (Garland and Heckbert, SIGGRAPH 1997; by VTK)")
      .in("mesh", "surface")
      .out("mesh", "the same surface with fewer triangles")
      .option("triangles", &Options::triangles,
              "approximate number of triangles to keep; a mesh with fewer triangles is not changed",
              marrow::at_least(100));
}
