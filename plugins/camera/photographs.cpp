// SPDX-License-Identifier: Apache-2.0
// Colour photographs as views like those of an X-ray device, so that the same nodes find edges and outlines in them.
#include <array>
#include <cmath>
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

struct Options {
  double gamma = 2.2;
  std::array<double, 3> colour_weights{0.3, 0.4, 0.3};
  double white_integral = 1;
};

constexpr double kBrightest = 65535;

/// Light takes the place of the line integrals of an X-ray image. So bright things become dark, and the logarithm that
/// nodes take of X-ray images gives the light again. Blur is then symmetric about each border.
cv::Mat as_x_ray(const cv::Mat& photograph, const Options& options) {
  std::array<std::array<double, 256>, 3> light;
  double sum = 0;
  for (const double weight : options.colour_weights) sum += weight;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t level = 0; level < 256; ++level)
      light[k][level] = options.colour_weights[k] / sum * std::pow(double(level) / 255, options.gamma);
  cv::Mat result(photograph.rows, photograph.cols, CV_16U);
  for (int v = 0; v < photograph.rows; ++v) {
    const cv::Vec3b* from = photograph.ptr<cv::Vec3b>(v);
    std::uint16_t* to = result.ptr<std::uint16_t>(v);
    for (int u = 0; u < photograph.cols; ++u)
      to[u] = std::uint16_t(
          std::lround(kBrightest * std::exp(-options.white_integral *
                                            (light[0][from[u][0]] + light[1][from[u][1]] + light[2][from[u][2]]))));
  }
  return result;
}

List<View> photographs(const List<Picture>& pictures, const List<Camera>& cameras, const Calibration& calibration,
                       const Options& options) {
  if (options.colour_weights[0] + options.colour_weights[1] + options.colour_weights[2] <= 0)
    throw Error("camera.photographs: the weights of red, green and blue must not all be 0");
  List<View> views;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    const std::string& name = pictures.name(i);
    const cv::Mat& pixels = pictures[i].pixels;
    if (pixels.empty() || pixels.type() != CV_8UC3)
      throw Error("photograph '" + name + "' is not a colour picture of 8 bits");
    const Camera* camera = cameras.find(name);
    if (!camera) throw Error("there is no camera for photograph '" + name + "'; calibrate it with the same names");
    View view{name, {as_x_ray(pixels, options)}, *camera, {}};
    apply_calibration(view, calibration);
    views.add(name, std::move(view));
  }
  return views;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("camera.photographs", photographs)
      .summary(
          "Colour photographs as grey views without distortion, in which bright things are dark, as in X-ray images")
      .in("photographs", "photographs, 8 bit colour", over("view"))
      .in("cameras", "camera of each photograph", over("view"))
      .in("calibration", "camera matrix and distortion of the device that took them")
      .out("views", "views of 16 bits; minus the logarithm of their grey values is linear in the light", over("view"))
      .option("gamma", &Options::gamma, "of the device: grey value = 255 light^(1 / gamma)", at_least(0.1), at_most(10),
              unit("1"))
      .option("colour_weights", &Options::colour_weights, "weights of red, green and blue light")
      .option("white_integral", &Options::white_integral, "line integral that white light stands for", at_least(0.01),
              at_most(5), unit("1"));
}
