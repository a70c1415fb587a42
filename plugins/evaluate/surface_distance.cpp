// SPDX-License-Identifier: Apache-2.0
// Distance between two surfaces: exact distances from points on each surface to the triangles of the other.
#include <vtkImplicitPolyDataDistance.h>
#include <vtkNew.h>

#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/domain/quantile.hpp"
#include "marrow/toolbox/geometry/targets.hpp"
#include "marrow/toolbox/vtk/poly_data.hpp"

namespace {

using namespace marrow;

struct Options {
  int points = 20000;
};

/// The sign of VTK's distance outside a surface. It follows the triangles' normals, which face outwards if the enclosed
/// volume is positive. The volume is taken about the surface's middle, so small holes do not change its sign.
double sign_outside(Mesh reference, const Context& context) {
  if (!is_closed(reference))
    context.warn("the reference is not closed, so the sign of bias_mm follows the side of the nearest triangle");
  const Eigen::Vector3d middle_mm = fragment_frame(reference).origin_mm;
  for (Eigen::Vector3d& vertex : reference.vertices_mm) vertex -= middle_mm;
  if (enclosed_volume_mm3(reference) >= 0) return 1;
  context.warn("the triangles of the reference face inwards; bias_mm takes them as facing outwards");
  return -1;
}

/// Signed distances (negative inside) from points spread over one surface to another surface. The vertices count only
/// for the largest distance, which is usually at a vertex. They would distort the mean, because a finer mesh has more
/// of them.
struct Distances {
  std::vector<double> of_points_mm;
  double largest_mm = 0;
};

Distances distances_from(const Mesh& mesh, const Mesh& other, int points, const Context& context) {
  vtkNew<vtkImplicitPolyDataDistance> surface;
  surface->SetInput(marrow::vtk::poly_data(other));
  Distances distances;
  const auto signed_distance = [&](Eigen::Vector3d point) {
    const double distance = surface->EvaluateFunction(point.data());
    distances.largest_mm = std::max(distances.largest_mm, std::abs(distance));
    return distance;
  };
  for (const Eigen::Vector3d& point : sample_surface(mesh, std::size_t(points)))
    distances.of_points_mm.push_back(signed_distance(point));
  context.check_cancelled();
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) signed_distance(vertex);
  context.check_cancelled();
  return distances;
}

Metrics surface_distance(const Mesh& mesh, const Mesh& reference, const Options& options, Context& context) {
  check_mesh(mesh, "mesh");
  check_mesh(reference, "reference");
  if (mesh.frame != reference.frame)
    throw Error("the mesh is in the frame '" + mesh.frame + "', but the reference in '" + reference.frame +
                "'; move one of them into the frame of the other");
  const Distances there = distances_from(mesh, reference, options.points, context),
                  back = distances_from(reference, mesh, options.points, context);
  std::vector<double> both;
  for (const Distances* one : {&there, &back})
    for (const double distance : one->of_points_mm) both.push_back(std::abs(distance));
  Metrics metrics;
  metrics.items = {{"mean_mm", geometry::mean(both), "mm"},
                   {"rms_mm", geometry::root_mean_square(both), "mm"},
                   {"p95_mm", quantile(both, 0.95), "mm"},
                   {"max_mm", std::max(there.largest_mm, back.largest_mm), "mm"},
                   {"bias_mm", sign_outside(reference, context) * geometry::mean(there.of_points_mm), "mm"}};
  return metrics;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.surface_distance", surface_distance)
      .summary(
          "Distances between two surfaces, in both directions: mean, root mean square, 95th percentile, maximum "
          "(Hausdorff) and bias")
      .in("mesh", "surface")
      .in("reference", "surface to compare with")
      .out("metrics",
           "figures over the points of both surfaces; bias is the mean signed distance of the mesh from the reference, "
           "positive if the mesh is too large")
      .figures({"mean_mm", "rms_mm", "p95_mm", "max_mm", "bias_mm"})
      .option("points", &Options::points, "number of points spread over each surface", at_least(100), at_most(1e6));
}
