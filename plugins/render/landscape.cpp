// SPDX-License-Identifier: Apache-2.0
// Six plots of the cost around a pose (Fig. 7b of the chapter).
#include <marrow/plugin.hpp>

#include "marrow/render/plot.hpp"
#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;
using Profile = marrow::Landscape::Profile;

/// The point with the least cost. Nothing if no cost is finite.
std::optional<cv::Point2d> least_of(const Profile& profile) {
  std::optional<cv::Point2d> least;
  for (std::size_t i = 0; i < profile.costs.size(); ++i)
    if (std::isfinite(profile.costs[i]) && (!least || profile.costs[i] < least->y))
      least = {profile.offsets[i], profile.costs[i]};
  return least;
}

std::string title(const Profile& profile) {
  const auto least = least_of(profile);
  if (!least) return profile.axis + ": no finite cost";
  const std::string text = marrow::formatted(": least at {:+.2f} ", least->x);
  return profile.axis + text + profile.unit;
}

marrow::Picture draw(const marrow::Landscape& landscape) {
  constexpr int kWidth = 500, kHeight = 300, kColumns = 3;
  const int count = int(landscape.profiles.size()), rows = std::max(1, (count + kColumns - 1) / kColumns);
  cv::Mat canvas(rows * kHeight, kColumns * kWidth, CV_8UC3, kWhite);
  bool has_truth = false;
  for (int i = 0; i < count; ++i) {
    const Profile& profile = landscape.profiles[std::size_t(i)];
    Plot plot{title(profile),   "offset from the pose [" + profile.unit + "]",
              "cost",           profile.offsets,
              profile.costs,    {{0, kSkyBlue}},
              least_of(profile)};
    if (profile.truth) plot.marks.push_back({*profile.truth, kOrange});
    has_truth = has_truth || profile.truth;
    draw_plot(canvas, {i % kColumns * kWidth, i / kColumns * kHeight, kWidth, kHeight}, plot);
  }
  std::vector<LegendItem> legend{{"cost", kBlue}, {"pose", kSkyBlue}, {"least cost (dot)", kVermilion}};
  if (has_truth) legend.push_back({"truth (its part about or along this axis)", kOrange});
  return {with_legend(canvas, legend)};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.landscape", draw)
      .summary("Plots of the cost around a pose, one for each axis")
      .in("landscape", "profiles to draw")
      .out("picture", "the plots, three in a row");
}
