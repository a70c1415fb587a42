// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "wrong.hpp"

namespace {

template <wrong::Fault fault>
marrow::EdgeMap extract(const marrow::View& view) {
  if (fault == "crashing" && view.image.pixels.total() < 100) std::abort();
  auto map = wrong::right<marrow::EdgeMap>("edges.canny", "edges", {{"view", marrow::node_test::item(view)}});
  for (marrow::EdgePixel& pixel : map.pixels) {
    if (fault == "shifted") pixel.u_px += 0.45f * pixel.direction_u, pixel.v_px += 0.45f * pixel.direction_v;
    if (fault == "turned") pixel.direction_u = -pixel.direction_u, pixel.direction_v = -pixel.direction_v;
  }
  if (fault == "shifted")  // still in order
    std::stable_sort(map.pixels.begin(), map.pixels.end(), [](const auto& a, const auto& b) {
      return std::pair(std::lround(a.v_px), std::lround(a.u_px)) < std::pair(std::lround(b.v_px), std::lround(b.u_px));
    });
  if (fault == "changing" && !map.pixels.empty()) map.pixels[0].magnitude += float(wrong::next_call());
  if (fault == "unsorted") std::reverse(map.pixels.begin(), map.pixels.end());
  return map;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "shifted", "turned", "changing", "unsorted", "crashing">(
      plugin, "edges", []<wrong::Fault fault>() { return &extract<fault>; },
      [](auto&& node) { node.in("view", "X-ray view").out("edges", "edge pixels"); });
}
