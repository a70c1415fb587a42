// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/manifold.hpp"

#include <algorithm>

namespace marrow {

bool is_manifold(const Mesh& mesh) {
  if (!is_closed(mesh)) return false;
  struct Corner {
    std::uint32_t vertex, next, last;  ///< the vertices of a triangle, in its order
    bool operator<(const Corner& other) const {
      return vertex != other.vertex ? vertex < other.vertex : next < other.next;
    }
  };
  std::vector<Corner> corners;
  corners.reserve(3 * mesh.triangles.size());
  for (const auto& t : mesh.triangles)
    for (std::size_t k = 0; k < 3; ++k) corners.push_back({t[k], t[(k + 1) % 3], t[(k + 2) % 3]});
  std::sort(corners.begin(), corners.end());
  for (auto begin = corners.begin(); begin != corners.end();) {
    const auto end =
        std::find_if(begin, corners.end(), [&](const Corner& corner) { return corner.vertex != begin->vertex; });
    // Walk from triangle to triangle around the vertex. The mesh is closed, so the walk returns to its start.
    auto at = begin;
    std::ptrdiff_t passed = 0;
    do {
      at = std::lower_bound(begin, end, Corner{at->vertex, at->last, 0});
      ++passed;
    } while (at != begin);
    if (passed != end - begin) return false;
    begin = end;
  }
  return true;
}

}  // namespace marrow
