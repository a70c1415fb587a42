// SPDX-License-Identifier: Apache-2.0
// A trained network says what each pixel shows. Metal and what lies outside of the detector's field must not count
// where a bone is compared with the image.

#include "marrow/mask/leave_out.hpp"
#include "marrow/toolbox/network/inference.hpp"

namespace {

using namespace marrow;

struct Options {
  std::filesystem::path network;
  std::vector<std::string> leave_out{"metal", "outside"};
  double probability = 0.5;
  int margin_px = 3;
  double object_distance_mm = 0;
};

/// CV_8U, 255 where the classes together are probable.
cv::Mat pixels_of_classes(const View& view, const Options& options, const Context& context) {
  const network::Network network = network::read_for_views(options.network, "mask.network");
  const network::Output& output = network::output_of(network.description(), network::Output::Kind::classes);
  const std::vector<cv::Mat> maps = network::maps_of_view(network, output, view, options.object_distance_mm, context);
  cv::Mat sum = cv::Mat::zeros(view.image.pixels.size(), CV_32F);
  for (const std::size_t channel : network::channels_of_classes(network.description(), output, options.leave_out))
    sum += maps[channel];
  return sum >= options.probability;
}

View network_mask(const View& view, const Options& options, Context& context) {
  const View result = mask::without(view, pixels_of_classes(view, options, context), options.margin_px);
  if (cv::countNonZero(result.mask) == 0)
    context.warn("the network leaves out the whole image; is it made for images like this one?");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("mask.network", network_mask)
      .summary("Leaves out the pixels in which a trained network sees metal or the outside of the detector's field")
      .in("view", "X-ray view")
      .out("view", "the same view; its mask is 0 where the network sees these classes, and where it was 0 before")
      .option("network", &Options::network,
              "the network's description, a YAML file with the output 'classes'; its ONNX file lies beside it",
              required(), beside({".onnx"}))
      .option("leave_out", &Options::leave_out, "classes that do not count")
      .relation(at_least_one({"leave_out"}))
      .option("probability", &Options::probability, "least sum of their probabilities where a pixel is left out",
              at_least(0), at_most(1))
      .option("margin_px", &Options::margin_px, "pixels this near to them are left out, too", at_least(0), at_most(100))
      .option("object_distance_mm", &Options::object_distance_mm,
              "distance of the bone from the source, where the network's pixels have their size; 0: that of the "
              "world's origin",
              at_least(0));
}
