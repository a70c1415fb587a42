// The kind "new_kind": its contract, and what each of its nodes must do. Its nodes here take an X-ray view and give it
// back with less noise. Put your own inputs, outputs and checks in their place.
#include <marrow/plugin.hpp>

namespace {
namespace suite = marrow::conformance;

/// An edge in noise, for which a node is called.
suite::Inputs step_with_noise() {
  cv::Mat pixels(64, 64, CV_32F, cv::Scalar(100)), noise(64, 64, CV_32F);
  pixels.colRange(32, 64).setTo(200);
  cv::RNG(1).fill(noise, cv::RNG::NORMAL, 0, 10);
  marrow::View view{"step", marrow::Image{pixels + noise}, {}, {}};
  view.camera.width_px = view.camera.height_px = 64;
  return {{"view", suite::item(view)}};
}

/// What must hold for every output, whatever the input was.
void validate(const suite::Inputs& inputs, const std::vector<marrow::PortInfo>&,
              const std::vector<marrow::Value>& outputs) {
  const cv::Size size = inputs.at("view").as<marrow::View>().image.pixels.size();
  suite::expect(outputs[0].as<marrow::View>().image.pixels.size() == size, "the image has another size");
}

/// A figure with a limit: the noise that is left where the image should be even.
double noise_left(const suite::Subject& subject) {
  const marrow::View view = subject.output(step_with_noise(), "view").as<marrow::View>();
  cv::Scalar mean, deviation;
  cv::meanStdDev(view.image.pixels(cv::Rect(4, 4, 20, 56)), mean, deviation);
  return deviation[0];
}
}  // namespace

MARROW_PLUGIN(plugin) {
  suite::Suite checks{step_with_noise, validate, {}, {{{"noise", "noise left of 10", 6, "grey"}, noise_left}}};
  plugin.kind("new_kind")
      .summary("less noise in an X-ray view")
      .in<marrow::View>("view", "X-ray view")
      .out<marrow::View>("view", "the same with less noise")
      .suite(checks);
}
