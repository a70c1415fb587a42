// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgproc.hpp>

#include "harness/message_of.hpp"
#include "marrow/toolbox/network/inference.hpp"
#include "tests/plugins/edges/drawn.hpp"
#include "written.hpp"

namespace marrow::test::view_maps_test {

using network::Normalisation;

/// The value itself.
const Convolution kSame{.side = 1, .weights = {1}, .bias = {0}};

network::Input input_by(Normalisation::Method method, double low = 0, double high = 1) {
  network::Input input;
  input.normalisation = {method, low, high};
  return input;
}

TEST(Normalised, FollowsItsMethod) {
  const cv::Mat values = (cv::Mat1f(1, 5) << 10, 20, 30, 40, 900);
  const cv::Mat counts = (cv::Mat1b(1, 5) << 1, 1, 1, 1, 0);
  const auto at = [](const cv::Mat& mat, int i) { return mat.at<float>(0, i); };
  const cv::Mat fixed = network::normalised(values, counts, input_by(Normalisation::Method::fixed, 10, 30));
  EXPECT_NEAR(at(fixed, 3), 1.5, 1e-6);
  const cv::Mat percent = network::normalised(values, counts, input_by(Normalisation::Method::percentiles, 0, 100));
  EXPECT_NEAR(at(percent, 1), 1.0 / 3, 1e-6) << "the pixel that does not count is not the greatest";
  EXPECT_NEAR(at(percent, 4), 890.0 / 30, 1e-4);
  const cv::Mat deviation = network::normalised(values, counts, input_by(Normalisation::Method::deviation));
  EXPECT_NEAR(at(deviation, 0), -15 / std::sqrt(125.0), 1e-6) << "mean 25, variance 125";
  network::Input dark = input_by(Normalisation::Method::percentiles, 0, 100);
  dark.bone_is_bright = false;
  EXPECT_NEAR(at(network::normalised(values, counts, dark), 1), 2.0 / 3, 1e-6);
  const cv::Mat constant =
      network::normalised(cv::Mat1f(3, 3, 7.0f), {}, input_by(Normalisation::Method::percentiles, 1, 99));
  EXPECT_EQ(cv::norm(constant, cv::NORM_INF), 0);
}

/// A view of a Gaussian spot, dark like bone.
View spot(int size, double u, double v, double sigma) {
  return edges::drawn(size, [=](double x, double y) {
    return 50000 - 40000 * std::exp(-0.5 * ((x - u) * (x - u) + (y - v) * (y - v)) / (sigma * sigma));
  });
}

cv::Point2d centre_of(const cv::Mat1f& map) {
  double sum = 0, u = 0, v = 0;
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x) sum += map(y, x), u += map(y, x) * x, v += map(y, x) * y;
  return {u / sum, v / sum};
}

class MapsOfView : public testing::TestWithParam<const char*> {};

TEST_P(MapsOfView, LieWhereTheImageShowsThem) {
  const View view = spot(150, 83.3, 61.7, 9);
  std::string text = with(kPlain, "pixel_px: 1", GetParam());
  text = with(text, "method: fixed, low: 0, high: 1", "method: percentiles, low: 0, high: 100");
  const Written written(kSame.bytes(), text);
  const network::Network network(network::read_description(written.file()));
  const network::Output& output = network.description().outputs[0];
  const cv::Mat map = network::maps_of_view(network, output, view, 0, Context())[0];
  ASSERT_EQ(map.size(), view.image.pixels.size());
  const cv::Point2d centre = centre_of(map);
  EXPECT_NEAR(centre.x, 83.3, 0.1);
  EXPECT_NEAR(centre.y, 61.7, 0.1);
  const network::ViewMaps raw = network::raw_maps_of_view(network, output, view, 0, Context());
  const cv::Point2d in_map = centre_of(raw.channels[0]);
  EXPECT_NEAR((in_map.x + 0.5) * raw.step_u_px - 0.5, 83.3, 0.1);
  EXPECT_NEAR((in_map.y + 0.5) * raw.step_v_px - 0.5, 61.7, 0.1);
}

INSTANTIATE_TEST_SUITE_P(PixelSizes, MapsOfView,
                         testing::Values("pixel_px: 1", "pixel_px: 2", "pixel_px: 3.3", "pixel_px: 0.7"));

TEST(ViewMaps, HavePixelsOfTheSizeAtTheBone) {
  View view = spot(150, 83.3, 61.7, 9);
  view.camera.camera_from_world.translation_mm.z() = 600;
  const double pixel_mm = 600 / view.camera.intrinsics(0, 0);
  const Written written(kSame.bytes(), with(kPlain, "pixel_px: 1", "pixel_mm: " + std::to_string(2 * pixel_mm)));
  const network::Network network(network::read_description(written.file()));
  const auto columns = [&](double object_distance_mm) {
    return network::raw_maps_of_view(network, network.description().outputs[0], view, object_distance_mm, Context())
        .channels[0]
        .cols;
  };
  EXPECT_EQ(columns(0), 75) << "at the world's origin";
  EXPECT_EQ(columns(1200), 150) << "twice as far, so a pixel shows twice as much";
  view.camera.camera_from_world.translation_mm.z() = -5;
  EXPECT_NE(message_of([&] { columns(0); }).find("lies behind the source"), std::string::npos);
}

/// Nodes by a network that says 1 where the line integral is above a threshold.
TEST(NetworkNodes, KeepWhatTheNetworkSees) {
  View view = edges::drawn(160, [](double u, double v) {
    const bool left = std::hypot(u - 45, v - 80) < 25, right = std::hypot(u - 115, v - 80) < 25;
    return left ? 26800.0 : right ? 10000.0 : 40000.0;  // the line integrals are 0.40 and 1.39
  });
  // Nearly 1 above a line integral of 0.5, nearly 0 below.
  const Written written(Convolution{.side = 1, .weights = {100}, .bias = {-50}}.bytes(),
                        with(with(kPlain, "activation: none", "activation: sigmoid"), "grey_values", "line_integrals"));
  const auto option = [&] { return Options{{"network", written.file().string()}}; };
  const EdgeMap edges = shipped::output<EdgeMap>("edges.network", "edges", {{"view", item(view)}}, option());
  ASSERT_GT(edges.pixels.size(), 60u);
  for (const EdgePixel& pixel : edges.pixels)
    EXPECT_NEAR(std::hypot(pixel.u_px - 115, pixel.v_px - 80), 25, 1.0) << "only the disc that the network sees";

  const Written classes(Convolution{.side = 1, .weights = {0, 100}, .bias = {0, -100}}.bytes(),
                        with(with(kPlain, "edge_strength: {layer: maps, activation: none}",
                                  "classes: {layer: maps, names: [bone, metal], activation: softmax}"),
                             "grey_values", "line_integrals"));
  Options options{{"network", classes.file().string()}, {"leave_out", Strings{"metal"}}, {"margin_px", 2}};
  const auto masked = [&] {
    return shipped::output<View>("mask.network", "view", {{"view", item(view)}}, options).mask;
  };
  const cv::Mat mask = masked();
  const auto at = [&](int u, int v) { return int(mask.at<std::uint8_t>(v, u)); };
  EXPECT_EQ(at(115, 80), 0);
  EXPECT_EQ(at(115, 80 + 26), 0) << "the margin";
  EXPECT_EQ(at(115, 80 + 29), 255);
  EXPECT_EQ(at(45, 80), 255);
  options["leave_out"] = Strings{"metals"};
  EXPECT_NE(message_of(masked).find("the network has no class 'metals'; did you mean 'metal'?"), std::string::npos);
}

}  // namespace marrow::test::view_maps_test
