// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vtkCellArray.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <marrow/domain/mesh.hpp>

namespace marrow::vtk {

/// Copies a surface for VTK's filters. Coordinates stay in mm, as doubles.
inline vtkSmartPointer<vtkPolyData> poly_data(const Mesh& mesh) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) points->InsertNextPoint(vertex.data());
  vtkNew<vtkCellArray> polygons;
  for (const auto& triangle : mesh.triangles) {
    const vtkIdType corners[3] = {vtkIdType(triangle[0]), vtkIdType(triangle[1]), vtkIdType(triangle[2])};
    polygons->InsertNextCell(3, corners);
  }
  auto data = vtkSmartPointer<vtkPolyData>::New();
  data->SetPoints(points);
  data->SetPolys(polygons);
  return data;
}

}  // namespace marrow::vtk
