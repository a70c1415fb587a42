// SPDX-License-Identifier: Apache-2.0
// A plain shaft node, and five that are wrong in one way each: the suite must catch each of them. Pairing is that of
// the shaft nodes; only the lines are found here, by trying directions and places one after the other.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "marrow/shaft/pairs.hpp"
#include "wrong.hpp"

namespace {

using namespace marrow::shaft;

/// Lines in steps of 1 degree and 2 px that 40 edge pixels lie on, the best first.
std::vector<Border> lines_of(const marrow::EdgeMap& edges) {
  std::vector<Border> lines;
  const int reach = int(std::hypot(edges.width_px, edges.height_px)) / 2;
  for (int degree = 0; degree < 360; ++degree) {
    const double angle = marrow::radians(degree);
    const Eigen::Vector2d normal(std::cos(angle), std::sin(angle));
    std::vector<int> counts(std::size_t(2 * reach + 1), 0);
    for (const marrow::EdgePixel& edge : edges.pixels) {
      if (normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) < 0.98) continue;
      const long place = std::lround(0.5 * normal.dot(Eigen::Vector2d(edge.u_px, edge.v_px))) + reach;
      if (place >= 0 && place < long(counts.size())) ++counts[std::size_t(place)];
    }
    for (int place = 1; place + 1 < int(counts.size()); ++place)
      if (counts[place] >= 40 && counts[place] >= counts[place - 1] && counts[place] > counts[place + 1])
        lines.push_back({normal, 2.0 * (place - reach), counts[place], 0});
  }
  std::stable_sort(lines.begin(), lines.end(), [](const Border& a, const Border& b) { return a.pixels > b.pixels; });
  return lines;
}

void turn(marrow::LineSegment& segment, double degrees) {
  const Eigen::Vector2d middle = 0.5 * (segment.from_px + segment.to_px);
  for (Eigen::Vector2d* end : {&segment.from_px, &segment.to_px})
    *end = middle + Eigen::Rotation2Dd(marrow::radians(degrees)) * (*end - middle);
}

template <wrong::Fault fault>
marrow::ShaftLines shaft(const marrow::EdgeMap& edges, const marrow::View& view,
                         const marrow::List<marrow::View>* views, const LineOptions& options,
                         marrow::Context& context) {
  if (fault == "crashing" && edges.pixels.size() < 2) std::abort();
  const Scale scale = checked_scale(edges, view, views, options, context);
  marrow::ShaftLines lines =
      best_pair(edges, view, supported_lines(edges, lines_of(edges), scale, options), scale, options);
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

template <wrong::Fault... faults>
void declare(marrow::Plugin& plugin) {
  (declare_line_options(
       plugin.node(std::string("shaft.") + faults.name, shaft<faults>).summary("For a test of the suite")),
   ...);
}

}  // namespace

MARROW_PLUGIN(plugin) { declare<"plain", "inner", "turned", "swapped", "sure", "crashing">(plugin); }
