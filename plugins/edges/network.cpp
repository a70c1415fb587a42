// SPDX-License-Identifier: Apache-2.0
// A trained network says at which pixels a border of bone passes. Where exactly it passes there, and in which direction
// the grey value rises, is measured on the image as the other extractors do it: a network's maps are too coarse for
// that.
#include "marrow/edges/threshold.hpp"
#include "marrow/toolbox/network/inference.hpp"

namespace {

using namespace marrow;
using namespace marrow::edges;

struct Options : ThresholdOptions {
  Options() { threshold = 2; }  // the network has judged; this leaves out only ridges of the noise
  std::filesystem::path network;
  double strength = 0.5;
  double object_distance_mm = 0;
};

cv::Mat strength_of(const View& view, const Options& options, const Context& context) {
  const network::Network network = network::read_for_views(options.network, "edges.network");
  const network::Output& output = network::output_of(network.description(), network::Output::Kind::edge_strength);
  return network::maps_of_view(network, output, view, options.object_distance_mm, context)[0];
}

EdgeMap network_edges(const View& view, const Options& options, Context& context) {
  const Prepared image = prepare(view, options.sigma_px, options.logarithm, context);
  const cv::Mat strength = strength_of(view, options, context);
  const Gradient gradient = gaussian_gradient(image.values, options.sigma_px);
  EdgeMap edges =
      edges_above_noise(image, gradient, options, [&](int u, int v) { return way_to_ridge(gradient, u, v); });
  std::erase_if(edges.pixels, [&](const EdgePixel& pixel) {
    return bilinear(strength, pixel.u_px, pixel.v_px) < float(options.strength);
  });
  return edges;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  declare_thresholds(
      plugin.node("edges.network", network_edges)
          .summary(
              "Edges where a trained network sees a border of bone, at sub-pixel positions of the image's gradient")
          .option(
              "network", &Options::network,
              "the network's description, a YAML file with the output 'edge_strength'; its ONNX file lies beside it",
              required(), beside({".onnx"}))
          .option("strength", &Options::strength, "least value of the network where an edge is kept", at_least(0),
                  at_most(1))
          .option("sigma_px", &Options::sigma_px, "standard deviation of the Gaussian derivative", at_least(0.7),
                  at_most(10))
          .option("object_distance_mm", &Options::object_distance_mm,
                  "distance of the bone from the source, where the network's pixels have their size; 0: that of the "
                  "world's origin",
                  at_least(0)));
}
