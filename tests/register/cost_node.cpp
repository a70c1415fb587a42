// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"
#include "plugins/similarity/contour_distance.cpp"

std::shared_ptr<const marrow::Cost> cost_node(const marrow::OutlineProjector& projector,
                                              const marrow::List<marrow::View>& views,
                                              const marrow::List<marrow::EdgeMap>& edges) {
  Options options;
  options.model_error_px = 0;  // ideal edges have none
  return contour_distance(projector, views, edges, nullptr, nullptr, options);
}
