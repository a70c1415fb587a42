// SPDX-License-Identifier: Apache-2.0
#include <vtkCellArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>

#include <marrow/plugin.hpp>

#include "marrow/mesh/surface.hpp"

namespace {

using marrow::Mesh, marrow::SignedField;

using Options = marrow::surface::Finish;

/// Copies the field, in index coordinates, with one more layer around it. The layer is the mirrored field, turned to
/// outside. So the surface is closed half a voxel beyond the last samples.
void fill(vtkImageData& image, const SignedField& field) {
  const auto& size = field.grid.size;
  image.SetExtent(-1, size[0], -1, size[1], -1, size[2]);
  image.AllocateScalars(VTK_FLOAT, 1);
  const marrow::surface::Padded padded(field);
  float* out = static_cast<float*>(image.GetScalarPointer());
  for (int z = -1; z <= size[2]; ++z)
    for (int y = -1; y <= size[1]; ++y)
      for (int x = -1; x <= size[0]; ++x) *out++ = padded(x, y, z);
}

Mesh flying_edges(const SignedField& field, const Options& options) {
  marrow::surface::check_field(field);
  vtkNew<vtkImageData> image;
  fill(*image, field);
  vtkNew<vtkFlyingEdges3D> filter;
  filter->SetInputData(image);
  filter->SetValue(0, 0.0);
  filter->ComputeNormalsOff();
  filter->ComputeGradientsOff();
  filter->ComputeScalarsOff();
  // Uses the run's oneTBB threads. The output is repeatable, because each row knows its place before it is written.
  filter->Update();
  vtkPolyData* surface = filter->GetOutput();

  Mesh mesh;
  mesh.frame = field.grid.frame;
  mesh.vertices_mm.resize(std::size_t(surface->GetNumberOfPoints()));
  for (vtkIdType v = 0; v < surface->GetNumberOfPoints(); ++v)
    mesh.vertices_mm[std::size_t(v)] = field.grid.point_from_index(Eigen::Vector3d(surface->GetPoint(v)));
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  for (surface->GetPolys()->InitTraversal(); surface->GetPolys()->GetNextCell(count, corners);) {
    std::array<std::uint32_t, 3> triangle{};
    for (int k = 0; k < 3; ++k) triangle[k] = std::uint32_t(corners[2 - k]);  // VTK's normals point to lower values
    mesh.triangles.push_back(triangle);
  }
  return marrow::surface::finish(std::move(mesh), options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.flying_edges", flying_edges)
      .summary("Flying edges of VTK (Schroeder, Maynard and Geveci, LDAV 2015)")
      .in("field", "signed distance, negative inside")
      .out("mesh", "closed surface of the field's zero level, normals outward")
      .option("largest_only", &Options::largest_only, marrow::surface::kLargestOnlyHelp)
      .option("smoothing", &Options::smoothing, marrow::surface::kSmoothingHelp, marrow::at_least(0),
              marrow::at_most(200));
}
