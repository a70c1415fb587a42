// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

#include "marrow/mesh/surface.hpp"

namespace {

using marrow::Mesh;

Mesh smooth(const Mesh& mesh, const marrow::surface::Taubin& options) {
  marrow::check_mesh(mesh, "mesh to smooth");
  if (!marrow::is_closed(mesh))
    throw marrow::Error(
        "mesh to smooth: it is not closed, as an edge has not just two triangles; a mesh node gives closed ones");
  marrow::surface::check_stable(options, "mesh to smooth");
  Mesh result = mesh;
  marrow::surface::smooth(result, options);
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mesh.smooth", smooth)
      .summary(
          "Smooths a surface without shrinking it (Taubin, A signal processing approach to fair surface design, "
          "SIGGRAPH 1995)")
      .in("mesh", "closed surface")
      .out("mesh", "the same triangles with moved vertices")
      .option("iterations", &marrow::surface::Taubin::iterations,
              "number of pairs of a smoothing step and an inflating step; at most as many as inflate no wave by more "
              "than 15 % (lambda = 0.5: 212 with a pass_band of 0.1, 21 with 0.3)",
              marrow::at_least(0), marrow::at_most(1000))
      .option("lambda", &marrow::surface::Taubin::lambda,
              "fraction of the way to the mean of the neighbours that a smoothing step goes; at most 0.7 with a "
              "pass_band of 0, 0.618 with 1, because more makes the shortest waves grow",
              marrow::at_least(0.01), marrow::at_most(0.7071))
      .option("pass_band", &marrow::surface::Taubin::pass_band,
              "waves longer than 2 pi / sqrt(pass_band) edges are kept; a smaller value smooths more",
              marrow::at_least(0.001), marrow::at_most(1));
}
