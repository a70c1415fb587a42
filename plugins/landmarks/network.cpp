// SPDX-License-Identifier: Apache-2.0
// A trained network says where each view shows named points. It gives a heat map for each name, which is high where the
// point is. The point is the centre of the map's peak, and its deviation follows from the peak's width.
#include <cmath>
#include <marrow/plugin.hpp>
#include <opencv2/core.hpp>
#include <optional>

#include "marrow/base/names.hpp"
#include "marrow/toolbox/network/inference.hpp"

namespace {

using namespace marrow;
using network::Output, network::ViewMaps;

struct Options {
  std::filesystem::path network;
  double least = 0.3;
  int peak_reach = 6;
  bool mirrored = false;
  double object_distance_mm = 0;
};

/// A point of the model, and the channel of the heat maps that shows it.
struct Wanted {
  std::string name;
  std::size_t channel;
};

std::string quoted(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
  return text;
}

/// The points that the network knows. Throws Error if it knows none of them.
std::vector<Wanted> wanted_of(const Landmarks& points, const Output& output, const Options& options,
                              const Context& context) {
  if (points.points.empty()) throw Error("there are no points to look for; give their places in the CT");
  std::vector<Wanted> wanted;
  std::vector<std::string> unknown;
  for (const Landmarks::Point& point : points.points) {
    const auto found = std::find(output.names.begin(), output.names.end(), point.name);
    if (found == output.names.end())
      unknown.push_back(point.name);
    else
      wanted.push_back({point.name, std::size_t(found - output.names.begin())});
  }
  if (wanted.empty())
    throw Error(options.network.string() + ": the network knows none of the points; of '" + unknown.front() +
                "': " + suggestion(unknown.front(), output.names));
  if (!unknown.empty())
    context.info("the network does not know " + quoted(unknown) + "; these points are not looked for");
  return wanted;
}

struct Peak {
  Eigen::Vector2d centre;  ///< in pixels of the map
  double spread = 0;       ///< root mean square distance from the centre in one coordinate, in pixels of the map
};

/// The centre of mass around the map's highest value, of what exceeds a tenth of it. Absent if the highest value is
/// below `least`.
std::optional<Peak> peak_of(const cv::Mat& map, double least, int reach) {
  double highest = 0;
  cv::Point at;
  cv::minMaxLoc(map, nullptr, &highest, nullptr, &at);
  if (highest < least) return std::nullopt;
  double sum = 0, squares = 0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero();
  for (int v = std::max(0, at.y - reach); v <= std::min(map.rows - 1, at.y + reach); ++v)
    for (int u = std::max(0, at.x - reach); u <= std::min(map.cols - 1, at.x + reach); ++u) {
      const double value = std::max(0.0, map.at<float>(v, u) - 0.1 * highest);
      const Eigen::Vector2d off(u - at.x, v - at.y);
      sum += value;
      moment += value * off;
      squares += value * off.squaredNorm();
    }
  const Eigen::Vector2d centre = moment / sum;
  return Peak{Eigen::Vector2d(at.x, at.y) + centre,
              std::sqrt(0.5 * std::max(0.0, squares / sum - centre.squaredNorm()))};
}

/// The view as a mirror shows it: a bone of the right side looks like one of the left side.
View mirrored(View view) {
  cv::flip(view.image.pixels.clone(), view.image.pixels, 1);
  if (!view.mask.empty()) cv::flip(view.mask.clone(), view.mask, 1);
  return view;
}

/// Where a peak of the map lies in the view.
Landmarks::Seen seen_at(const Peak& peak, const ViewMaps& maps, double factor) {
  // A peak of one single pixel has no spread, but its place is not known better than a third of a pixel's width.
  constexpr double kLeastSpread = 0.3;
  Landmarks::Seen seen;
  seen.pixel = {(peak.centre.x() + 0.5) * maps.step_u_px - 0.5, (peak.centre.y() + 0.5) * maps.step_v_px - 0.5};
  seen.deviation_px = factor * std::sqrt(maps.step_u_px * maps.step_v_px) * std::max(kLeastSpread, peak.spread);
  return seen;
}

Landmarks network_landmarks(const Landmarks& points, const List<View>& views, const Options& options,
                            Context& context) {
  const network::Network network = network::read_for_views(options.network, "landmarks.network");
  const Output& output = network::output_of(network.description(), Output::Kind::heat_maps);
  const std::vector<Wanted> wanted = wanted_of(points, output, options, context);
  Landmarks result = points;
  result.seen.clear();
  for (std::size_t i = 0; i < views.size(); ++i) {
    check_view(views[i]);
    const ViewMaps maps = network::raw_maps_of_view(network, output, options.mirrored ? mirrored(views[i]) : views[i],
                                                    options.object_distance_mm, context);
    for (const Wanted& one : wanted)
      if (const auto peak = peak_of(maps.channels[one.channel], options.least, options.peak_reach)) {
        Landmarks::Seen seen = seen_at(*peak, maps, output.deviation_factor);
        if (options.mirrored) seen.pixel.x() = views[i].image.width() - 1 - seen.pixel.x();
        seen.name = one.name;
        seen.view = views.name(i);
        result.seen.push_back(seen);
      }
  }
  if (result.seen.empty())
    context.warn("the network sees none of the points; is it made for this bone and for images like these?");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("landmarks.network", network_landmarks)
      .summary("Named points where a trained network sees them, at the centre of the peak of each point's heat map")
      .in("points", "points in CT coordinates; their names choose the network's heat maps")
      .in("views", "X-ray views", over("view"))
      .out("landmarks", "the same points, with the pixel and the deviation of those that each view shows")
      .option("network", &Options::network,
              "the network's description, a YAML file with the output 'heat_maps'; its ONNX file lies beside it",
              required(), beside({".onnx"}))
      .option("least", &Options::least, "a point is not seen where the highest value of its map is below this",
              at_least(0), at_most(1))
      .option("peak_reach", &Options::peak_reach,
              "how far the peak reaches around the highest value, in pixels of the map; what is farther does not count",
              at_least(1), at_most(100))
      .option("mirrored", &Options::mirrored,
              "whether the network sees the images in a mirror: for a bone of the other side than those it learned")
      .option("object_distance_mm", &Options::object_distance_mm,
              "distance of the bone from the source, where the network's pixels have their size; 0: that of the "
              "world's origin",
              at_least(0));
}
