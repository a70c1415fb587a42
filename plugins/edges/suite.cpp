// SPDX-License-Identifier: Apache-2.0
// Checks for edge extractors on images whose edges are known exactly: a disc and a bar, dark like bone, blurred by a
// Gaussian, with noise.
#include <marrow/plugin.hpp>
#include <random>

#include "marrow/domain/quantile.hpp"

namespace {

using namespace marrow;
using namespace marrow::conformance;

constexpr int kWidth = 240, kHeight = 200;
// The contrast is so low that grey values and their logarithms have their edges at the same place.
constexpr double kBlur_px = 1.2, kBright = 40000, kDark = 32000, kNoise = 160;

/// The signed distance in px from the edge, positive on the bright side, and the unit normal towards the bright side.
struct Shape {
  std::function<double(double u, double v)> distance_px;
  std::function<Eigen::Vector2d(double u, double v)> outward;
};

Shape disc() {
  const Eigen::Vector2d centre(118.3, 99.6);
  constexpr double kRadius = 61.7;
  return {[=](double u, double v) { return (Eigen::Vector2d(u, v) - centre).norm() - kRadius; },
          [=](double u, double v) { return (Eigen::Vector2d(u, v) - centre).normalized(); }};
}

Shape bar() {
  const Eigen::Vector2d normal = Eigen::Vector2d(std::cos(0.5), std::sin(0.5));
  const auto across = [=](double u, double v) { return normal.dot(Eigen::Vector2d(u - 121.4, v - 98.2)); };
  return {[=](double u, double v) { return std::abs(across(u, v)) - 27.3; },
          [=](double u, double v) { return Eigen::Vector2d(across(u, v) > 0 ? normal : Eigen::Vector2d(-normal)); }};
}

View view_of(cv::Mat pixels) {
  View view;
  view.name = "frontal";
  view.camera.width_px = pixels.cols;
  view.camera.height_px = pixels.rows;
  view.camera.intrinsics << 1700, 0, 0.5 * (pixels.cols - 1), 0, 1700, 0.5 * (pixels.rows - 1), 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  view.image.pixels = std::move(pixels);
  return view;
}

cv::Mat picture(const Shape& shape, int type = CV_16U, double noise = kNoise) {
  std::mt19937 random(7);
  cv::Mat pixels(kHeight, kWidth, type);
  for (int v = 0; v < kHeight; ++v)
    for (int u = 0; u < kWidth; ++u) {
      double sum = 0;  // nearly normal: the sum of twelve uniform numbers
      for (int i = 0; i < 12; ++i) sum += double(random()) / 4294967296.0;
      const double value =
          kDark + (kBright - kDark) * 0.5 * (1 + std::erf(shape.distance_px(u, v) / (kBlur_px * std::sqrt(2.0)))) +
          noise * (sum - 6);
      if (type == CV_16U)
        pixels.at<std::uint16_t>(v, u) = std::uint16_t(value);
      else if (type == CV_8U)
        pixels.at<std::uint8_t>(v, u) = std::uint8_t(value / 257);
      else
        pixels.at<float>(v, u) = float(value);
    }
  return pixels;
}

Inputs inputs_of(cv::Mat pixels) { return {{"view", item(view_of(std::move(pixels)))}}; }

void validate(const Inputs& inputs, const std::vector<PortInfo>&, const std::vector<Value>& outputs) {
  const View& view = inputs.at("view").as<View>();
  expect(outputs.size() == 1 && !outputs[0].is_absent(), "it gives no edge map");
  const EdgeMap& map = outputs[0].as<EdgeMap>();
  expect(map.width_px == view.image.width() && map.height_px == view.image.height(),
         "the edge map is not as large as the image");
  std::pair<long, long> last{-1, -1};
  for (const EdgePixel& pixel : map.pixels) {
    expect(std::isfinite(pixel.u_px) && std::isfinite(pixel.v_px) && std::isfinite(pixel.magnitude) &&
               pixel.magnitude >= 0,
           "an edge pixel is not finite");
    expect(pixel.u_px >= -0.5 && pixel.v_px >= -0.5 && pixel.u_px <= map.width_px - 0.5 &&
               pixel.v_px <= map.height_px - 0.5,
           "an edge pixel lies outside the image");
    expect(std::abs(std::hypot(pixel.direction_u, pixel.direction_v) - 1) < 1e-3, "a direction is not of unit length");
    const std::pair<long, long> place{std::lround(pixel.v_px), std::lround(pixel.u_px)};
    expect(place >= last, "edge pixels are not in row-major order");
    last = place;
  }
}

/// An edge pixel farther than this from the true edge is false.
constexpr double kNear_px = 3;

EdgeMap edges_of(const Subject& subject, const Shape& shape) {
  return subject.output(inputs_of(picture(shape)), "edges").as<EdgeMap>();
}

std::vector<double> distances(const EdgeMap& map, const Shape& shape) {
  std::vector<double> found;
  for (const EdgePixel& pixel : map.pixels) {
    const double distance = shape.distance_px(pixel.u_px, pixel.v_px);
    if (std::abs(distance) <= kNear_px) found.push_back(distance);
  }
  expect(found.size() >= 100, formatted("it finds {} pixels of an edge that is hundreds long", found.size()));
  return found;
}

double bias(const Subject& subject, const Shape& shape) {
  return std::abs(quantile(distances(edges_of(subject, shape), shape), 0.5));
}

double spread(const Subject& subject, const Shape& shape) {
  const std::vector<double> found = distances(edges_of(subject, shape), shape);
  return 0.5 * (quantile(found, 0.975) - quantile(found, 0.025));
}

double false_percent(const Subject& subject, const Shape& shape) {
  const EdgeMap map = edges_of(subject, shape);
  expect(!map.pixels.empty(), "it finds no edge at all");
  const auto count = std::count_if(map.pixels.begin(), map.pixels.end(), [&](const EdgePixel& p) {
    return std::abs(shape.distance_px(p.u_px, p.v_px)) > kNear_px;
  });
  return 100.0 * double(count) / double(map.pixels.size());
}

/// Percentage of the true edge without an edge pixel within 2 px. The true edge is sampled at pixels that it crosses.
double missed_percent(const Subject& subject, const Shape& shape) {
  const EdgeMap map = edges_of(subject, shape);
  int all = 0, missed = 0;
  for (int v = 4; v < kHeight - 4; v += 2)
    for (int u = 4; u < kWidth - 4; u += 2) {
      if (std::abs(shape.distance_px(u, v)) > 0.5) continue;
      ++all;
      missed += std::none_of(map.pixels.begin(), map.pixels.end(),
                             [&](const EdgePixel& p) { return std::hypot(p.u_px - u, p.v_px - v) <= 2; });
    }
  return 100.0 * missed / all;
}

double direction_error(const Subject& subject, const Shape& shape) {
  std::vector<double> angles;
  for (const EdgePixel& p : edges_of(subject, shape).pixels)
    if (std::abs(shape.distance_px(p.u_px, p.v_px)) <= kNear_px)
      angles.push_back(degrees(std::acos(
          std::clamp(shape.outward(p.u_px, p.v_px).dot(Eigen::Vector2d(p.direction_u, p.direction_v)), -1.0, 1.0))));
  expect(!angles.empty(), "it finds no edge at all");
  return quantile_in_place(angles, 0.9);
}

std::vector<Trial> trials() {
  const auto plain = [](int width, int height) {
    return [=] { return inputs_of(cv::Mat(height, width, CV_16U, cv::Scalar(20000))); };
  };
  return {{"empty_image", plain(0, 0)},
          {"one_pixel", plain(1, 1)},
          {"one_row", plain(50, 1)},
          {"three_pixels", plain(3, 3)},
          {"constant_image", plain(100, 80)},
          {"black_image", [] { return inputs_of(cv::Mat(80, 100, CV_16U, cv::Scalar(0))); }},
          {"nan_pixel",
           [] {
             cv::Mat pixels = picture(disc(), CV_32F);
             pixels.at<float>(50, 60) = std::nanf("");
             return inputs_of(pixels);
           }},
          {"infinite_pixel",
           [] {
             cv::Mat pixels = picture(disc(), CV_32F);
             pixels.at<float>(50, 60) = std::numeric_limits<float>::infinity();
             return inputs_of(pixels);
           }},
          {"eight_bits", [] { return inputs_of(picture(disc(), CV_8U)); }},
          {"float_pixels", [] { return inputs_of(picture(disc(), CV_32F)); }},
          {"mask_of_nothing",
           [] {
             View view = view_of(picture(disc()));
             view.mask = cv::Mat(kHeight, kWidth, CV_8U, cv::Scalar(0));
             return Inputs{{"view", item(view)}};
           }},
          {"large_image", [] {
             cv::Mat pixels(2000, 3000, CV_16U, cv::Scalar(20000));
             pixels(cv::Rect(700, 500, 900, 800)).setTo(30000);
             return inputs_of(pixels);
           }}};
}

Suite suite_of_kind() {
  Suite suite{[] { return inputs_of(picture(disc())); }, validate, trials(), {}};
  for (const auto& [name, shape] : {std::pair<std::string, Shape>{"disc", disc()}, {"bar", bar()}}) {
    const std::string of = "edge of a " + name + ", blurred by 1.2 px, with noise of 2 % of its contrast";
    const auto add = [&, shape = shape](const std::string& what, const std::string& help, double limit,
                                        const std::string& unit, double (*measure)(const Subject&, const Shape&)) {
      suite.add(name + "_" + what, of + ": " + help, limit, unit,
                [measure, shape](const Subject& subject) { return measure(subject, shape); });
    };
    add("bias", "absolute value of the median signed distance", 0.2, "px", bias);
    add("spread", "half the width of the middle 95 % of the signed distances", 0.6, "px", spread);
    add("direction", "90th percentile of the angle between gradient and normal", 10, "deg", direction_error);
    add("missed", "part of the edge without an edge pixel within 2 px", 3, "%", missed_percent);
    add("false", "share of the edge pixels that are more than 3 px away from it", 40, "%", false_percent);
  }
  return suite;
}

}  // namespace

MARROW_PLUGIN(plugin) { plugin.suite("edges", suite_of_kind()); }
