// SPDX-License-Identifier: Apache-2.0
// mesh.marching_cubes against VTK's vtkFlyingEdges3D on a bone of about 500,000 triangles in 256 x 256 x 384 samples,
// both on 2 threads, from the same floats in memory to their own surface. They take turns, so that a busy machine slows
// both down.
#include <benchmark/benchmark.h>
#include <oneapi/tbb/global_control.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkVersion.h>

#include "plugins/mesh/marching_cubes.cpp"
#include "tests/benchmarks/timing.hpp"
#include "vtk_threads.hpp"

namespace {

constexpr int kThreads = 2;
constexpr double kLimit = 1.2;
bool within_limit = true;

/// A shaft with a canal and two flared ends, which lies within the grid.
SignedField hollow_bone() {
  SignedField field;
  field.grid.size = {256, 256, 384};
  field.values_mm.resize(field.grid.count());
  tbb::parallel_for(0, field.grid.size[2], [&](int z) {
    const double along = (z - 191.5) / 170, flare = 22 * along * along * along * along;
    for (int y = 0; y < field.grid.size[1]; ++y)
      for (int x = 0; x < field.grid.size[0]; ++x) {
        const double across = std::hypot(x - 127.6 - 6 * along * along, (y - 127.3) * 1.06);
        const double outer = std::max(across - 41 - flare, std::abs(z - 191.5) - 178);
        const double canal = std::max(across - 25 - 0.6 * flare, std::abs(z - 191.5) - 160);
        field.values_mm[field.grid.offset(x, y, z)] = float(std::clamp(std::max(outer, -canal), -5.0, 5.0));
      }
  });
  return field;
}

/// The field's own floats, seen by VTK.
vtkSmartPointer<vtkImageData> image_of(SignedField& field) {
  vtkNew<vtkFloatArray> values;
  values->SetArray(field.values_mm.data(), vtkIdType(field.values_mm.size()), 1);
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(field.grid.size.data());
  image->GetPointData()->SetScalars(values);
  return image;
}

using timing::median, timing::milliseconds;

/// `largest_only` is the node's default, and more than VTK does.
void against_vtk(benchmark::State& state, bool largest_only) {
  static SignedField field = hollow_bone();
  static const vtkSmartPointer<vtkImageData> image = image_of(field);
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, kThreads);
  Options options;
  options.largest_only = largest_only;
  std::vector<double> marrow_ms, vtk_ms;
  std::size_t marrow_triangles = 0, vtk_triangles = 0;
  for (auto _ : state) {
    marrow_ms.push_back(milliseconds([&] { marrow_triangles = marching_cubes(field, options).triangles.size(); }));
    vtk_ms.push_back(milliseconds([&] {
      vtkNew<vtkFlyingEdges3D> filter;
      filter->SetInputData(image);
      filter->SetValue(0, 0.0);
      filter->ComputeNormalsOff();
      filter->ComputeGradientsOff();
      filter->ComputeScalarsOff();
      filter->Update();
      vtk_triangles = std::size_t(filter->GetOutput()->GetNumberOfPolys());
    }));
  }
  const double ratio = median(marrow_ms) / median(vtk_ms);
  state.counters["marrow_ms"] = median(marrow_ms);
  state.counters["vtk_ms"] = median(vtk_ms);
  state.counters["ratio"] = ratio;
  std::printf(
      "mesh.marching_cubes%s: %zu triangles in %.1f ms; vtkFlyingEdges3D of VTK %s on %s: %zu in %.1f ms; ratio %.2f, "
      "limit %.1f\n",
      largest_only ? ", largest part" : "", marrow_triangles, median(marrow_ms), vtkVersion::GetVTKVersion(),
      use_vtk_threads(kThreads).c_str(), vtk_triangles, median(vtk_ms), ratio, kLimit);
  within_limit &= ratio <= kLimit;
}
BENCHMARK_CAPTURE(against_vtk, all_parts, false)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(timing::rounds(25));
BENCHMARK_CAPTURE(against_vtk, largest_part, true)
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(timing::rounds(25));

}  // namespace

int main(int argc, char** argv) {
  use_vtk_threads(kThreads);
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return within_limit || timing::is_short() ? 0 : 1;
}
