// SPDX-License-Identifier: Apache-2.0
// The exact borders of all fragments in an image, from their known surfaces and poses: what an edge extractor should
// find, for measures of it and for the training of networks.
#include <algorithm>
#include <cmath>
#include <marrow/plugin.hpp>
#include <utility>

namespace {

using namespace marrow;

/// The nearest pixel, as (row, column).
std::pair<long, long> pixel_of(const EdgePixel& edge) { return {std::lround(edge.v_px), std::lround(edge.u_px)}; }

EdgeMap true_edges(const Camera& camera, const List<Truth>& truths, const List<OutlineProjector>& projectors) {
  check_camera(camera, "evaluate.true_edges: the camera");
  EdgeMap edges{camera.width_px, camera.height_px, {}};
  for (std::size_t i = 0; i < truths.size(); ++i) {
    const OutlineProjector* outline = projectors.find(truths.name(i));
    if (!outline)
      throw Error("evaluate.true_edges: there is no outline of fragment '" + truths.name(i) +
                  "'; make outlines from the models of the node that gives the truths");
    for (const OutlinePoint& point : outline->outline(camera, truths[i].world_from_model, 1))
      edges.pixels.push_back({point.u_px, point.v_px, point.normal_u, point.normal_v, 1});
  }
  std::stable_sort(edges.pixels.begin(), edges.pixels.end(),
                   [](const EdgePixel& a, const EdgePixel& b) { return pixel_of(a) < pixel_of(b); });
  const auto last = std::unique(edges.pixels.begin(), edges.pixels.end(),
                                [](const EdgePixel& a, const EdgePixel& b) { return pixel_of(a) == pixel_of(b); });
  edges.pixels.erase(last, edges.pixels.end());
  return edges;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("evaluate.true_edges", true_edges)
      .summary("The exact borders of all fragments in an image, also where one lies before another")
      .in("camera", "camera of the view, as it really is")
      .in("truths", "exact pose of each fragment", over("fragment"))
      .in("projectors", "outline of each fragment's exact surface", over("fragment"))
      .out("edges", "one edge for each pixel that a border passes; directions point out of the bone, magnitudes are 1");
}
