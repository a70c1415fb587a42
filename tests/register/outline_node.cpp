// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"
#include "plugins/project/silhouette_edges.cpp"

std::shared_ptr<const marrow::OutlineProjector> outline_node(const marrow::Mesh& mesh, const marrow::Volume* volume) {
  return silhouette_edges(mesh, volume, Options{});
}
