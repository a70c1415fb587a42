// SPDX-License-Identifier: Apache-2.0
// Lines by OpenCV's version of the line segment detector LSD (Grompone von Gioi, Jakubowicz, Morel and Randall, IEEE
// TPAMI 2010). It grows regions of equal gradient direction in the image and keeps those that are unlikely to be noise.
// The segments only say where to search. The borders are fitted to the edge pixels beside them, so they are as accurate
// as the edges. Then they are paired as in shaft.hough_pairs.
#include <opencv2/imgproc.hpp>

#include "marrow/shaft/pairs.hpp"
#include "marrow/toolbox/image/grey_values.hpp"

namespace {

using namespace marrow::shaft;
using marrow::EdgeMap;

struct Options : LineOptions {
  double resolution_mm = 0.8;
};

constexpr double kSurroundings_mm = 15;
// The shortest segment, as a fraction of the length that borders must share. Noise cuts lines into pieces.
constexpr double kShortest = 0.15;

/// The line integrals minus their local mean, times -1, as 8 bits. In it, steps of attenuation have the same height
/// everywhere. The slope of the limb is removed; its direction is that of the bone's border and would disturb the
/// search.
cv::Mat eight_bits(const marrow::View& view, double pixel_mm) {
  cv::Mat grey;
  view.image.pixels.convertTo(grey, CV_32F);
  if (!cv::checkRange(grey))
    throw marrow::Error("view '" + view.name + "': the image holds pixels that are not finite (NaN or infinity)");
  if (!(marrow::image::grey_range(grey).greatest > 0))
    throw marrow::Error("view '" + view.name +
                        "': the image has no positive grey value, so its logarithm cannot be taken");
  grey = -marrow::image::line_integrals(grey);
  const int side = 2 * int(std::lround(0.5 * kSurroundings_mm / pixel_mm)) + 1;
  cv::Mat mean, scaled;
  cv::blur(grey, mean, {side, side});
  cv::normalize(grey - mean, scaled, 0, 255, cv::NORM_MINMAX, CV_8U);
  return scaled;
}

/// Moves a line to where the edge pixels beside a segment are densest. This is necessary because the gradient is not
/// always largest in the middle of a region of equal gradient direction. False if there are no edge pixels.
bool snap(const EdgeMap& edges, const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Support& support,
          Border& line) {
  constexpr double kReach = 4;  // in tolerances of `support`
  const Eigen::Vector2d way = (to - from).normalized();
  std::vector<double> distances;
  for (const marrow::EdgePixel& edge : edges.pixels) {
    const Eigen::Vector2d position(edge.u_px, edge.v_px);
    const double distance = line.normal.dot(position) - line.rho, s = way.dot(position - from);
    if (std::abs(distance) > kReach * support.tolerance_px || s < 0 || s > (to - from).norm()) continue;
    if (line.normal.dot(Eigen::Vector2d(edge.direction_u, edge.direction_v)) > support.direction_cosine)
      distances.push_back(distance);
  }
  std::sort(distances.begin(), distances.end());
  std::size_t most = 0;
  double best = 0;
  for (std::size_t first = 0, end = 0; first < distances.size(); ++first) {
    while (end < distances.size() && distances[end] < distances[first] + support.tolerance_px) ++end;
    if (end - first > most) most = end - first, best = 0.5 * (distances[first] + distances[end - 1]);
  }
  line.rho += best;
  return most > 0;
}

/// The lines of the segments, the longest first. The edge pixels decide which side of a line is brighter.
std::vector<Border> segment_lines(const EdgeMap& edges, const marrow::View& view, const Scale& scale,
                                  const Options& options) {
  const double shrink = std::min(1.0, scale.pixel_mm / options.resolution_mm);
  const auto detector = cv::createLineSegmentDetector(cv::LSD_REFINE_STD, shrink);
  std::vector<cv::Vec4f> segments;
  detector->detect(eight_bits(view, scale.pixel_mm), segments);
  const auto length = [](const cv::Vec4f& s) { return std::hypot(s[2] - s[0], s[3] - s[1]); };
  std::stable_sort(segments.begin(), segments.end(),
                   [&](const auto& a, const auto& b) { return length(a) > length(b); });
  std::vector<Border> lines;
  for (const cv::Vec4f& segment : segments) {
    if (length(segment) < kShortest * scale.min_length_px) break;
    const Eigen::Vector2d from(segment[0], segment[1]), to(segment[2], segment[3]);
    for (const double side : {1.0, -1.0}) {
      Border line;
      line.normal = side * Eigen::Vector2d(from.y() - to.y(), to.x() - from.x()).normalized();
      line.rho = line.normal.dot(0.5 * (from + to));
      if (snap(edges, from, to, scale.support, line)) lines.push_back(line);
    }
  }
  return lines;
}

marrow::ShaftLines line_segments(const EdgeMap& edges, const marrow::View& view,
                                 const marrow::List<marrow::View>* views, const Options& options,
                                 marrow::Context& context) {
  const Scale scale = checked_scale(edges, view, views, options, context);
  return best_pair(edges, view, supported_lines(edges, segment_lines(edges, view, scale, options), scale, options),
                   scale, options);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_line_options(
      plugin.node("shaft.line_segments", line_segments)
          .summary("Borders of the shaft: line segments in the image (LSD, by OpenCV), paired by the likelihood of the "
                   "outer diameter")
          .option("resolution_mm", &Options::resolution_mm,
                  "size of a pixel, in mm at the shaft, to which the image is reduced to find segments",
                  marrow::at_least(0.05), marrow::at_most(10)));
}
