// SPDX-License-Identifier: Apache-2.0
// Figures over the frames of a sequence, a plot for each figure.
#include <marrow/plugin.hpp>

#include "marrow/render/plot.hpp"
#include "marrow/toolbox/draw/canvas.hpp"

namespace {

using namespace marrow::draw;
using marrow::List, marrow::Metric, marrow::Metrics;

struct Options {
  std::vector<std::string> figures;
};

const Metric* find(const Metrics& metrics, const std::string& name) {
  for (const Metric& metric : metrics.items)
    if (metric.name == name) return &metric;
  return nullptr;
}

/// The names of the figures to draw: those asked for, or all of the first frame.
std::vector<std::string> names_of(const List<Metrics>& metrics, const Options& options) {
  if (metrics.empty()) throw marrow::Error("there is no frame to draw");
  std::vector<std::string> all;
  std::string known;
  for (const Metric& metric : metrics[0].items) {
    all.push_back(metric.name);
    known += (known.empty() ? "" : ", ") + metric.name;
  }
  for (const std::string& name : options.figures)
    if (std::find(all.begin(), all.end(), name) == all.end())
      throw marrow::Error("there is no figure '" + name + "'; there are " + known);
  return options.figures.empty() ? all : options.figures;
}

marrow::Picture draw(const List<Metrics>& metrics, const Options& options) {
  constexpr int kWidth = 500, kHeight = 260, kColumns = 3;
  const std::vector<std::string> names = names_of(metrics, options);
  const int rows = (int(names.size()) + kColumns - 1) / kColumns;
  cv::Mat canvas(rows * kHeight, kColumns * kWidth, CV_8UC3, kWhite);
  for (int i = 0; i < int(names.size()); ++i) {
    const std::string& name = names[std::size_t(i)];
    Plot plot{name, "frame", find(metrics[0], name)->unit, {}, {}, {}, {}};
    for (std::size_t frame = 0; frame < metrics.size(); ++frame) {
      const Metric* metric = find(metrics[frame], name);
      plot.x.push_back(double(frame + 1));
      plot.y.push_back(metric ? metric->value : std::numeric_limits<double>::quiet_NaN());
    }
    draw_plot(canvas, {i % kColumns * kWidth, i / kColumns * kHeight, kWidth, kHeight}, plot);
  }
  return {canvas};
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("render.curves", draw)
      .summary("Figures over the frames of a sequence, a plot for each figure")
      .in("metrics", "figures of each frame", marrow::over("frame"))
      .out("picture", "the plots, three in a row")
      .option("figures", &Options::figures, "names of the figures; none: all of the first frame");
}
