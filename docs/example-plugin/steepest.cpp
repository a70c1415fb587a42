#include <cmath>
#include <marrow/plugin.hpp>

namespace {
struct Options {
  double least = 500;
};

marrow::EdgeMap steepest(const marrow::View& view, const Options& options) {
  cv::Mat_<float> grey;
  view.image.pixels.convertTo(grey, CV_32F);
  marrow::EdgeMap edges{grey.cols, grey.rows, {}};
  for (int v = 1; v + 1 < grey.rows; ++v)
    for (int u = 1; u + 1 < grey.cols; ++u) {
      const float du = (grey(v, u + 1) - grey(v, u - 1)) / 2, dv = (grey(v + 1, u) - grey(v - 1, u)) / 2;
      const float slope = std::hypot(du, dv);
      if (slope >= options.least) edges.pixels.push_back({float(u), float(v), du / slope, dv / slope, slope});
    }
  return edges;
}
}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("edges.steepest", steepest)
      .summary("Every pixel whose grey value changes fast")
      .in("view", "X-ray view")
      .out("edges", "edge pixels")
      .option("least", &Options::least, "least change that makes an edge", marrow::at_least(0),
              marrow::unit("grey/px"));
}
