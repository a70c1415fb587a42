// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "wrong.hpp"

namespace {

using marrow::List;
using marrow::ShaftLines;
using marrow::View;

void turn(marrow::LineSegment& segment, double degrees) {
  const Eigen::Vector2d middle = 0.5 * (segment.from_px + segment.to_px);
  for (Eigen::Vector2d* end : {&segment.from_px, &segment.to_px})
    *end = middle + Eigen::Rotation2Dd(marrow::radians(degrees)) * (*end - middle);
}

template <wrong::Fault fault>
ShaftLines shaft(const marrow::EdgeMap& edges, const View& view, const List<View>* views) {
  if (fault == "crashing" && edges.pixels.size() < 2) std::abort();
  marrow::node_test::Inputs inputs{{"edges", marrow::node_test::item(edges)}, {"view", marrow::node_test::item(view)}};
  if (views) inputs["views"] = marrow::node_test::list(*views, "view");
  auto lines = wrong::right<ShaftLines>("shaft.hough_pairs", "lines", inputs);
  if (fault == "inner")
    for (const auto& pair : lines.rejected)
      if (pair.reason.find("canal") != std::string::npos) {
        lines.left = pair.left, lines.right = pair.right;
        break;
      }
  if (fault == "turned") turn(lines.left, 0.3);
  if (fault == "swapped") std::swap(lines.left, lines.right);
  if (fault == "sure") lines.width_deviation_mm = 0.001;
  return lines;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  wrong::declare<"plain", "inner", "turned", "swapped", "sure", "crashing">(
      plugin, "shaft", []<wrong::Fault fault>() { return &shaft<fault>; },
      [](auto&& node) {
        node.in("edges", "edge pixels")
            .in("view", "X-ray view")
            .in("views", "all views", marrow::over("view"))
            .out("lines", "borders of the shaft");
      });
}
