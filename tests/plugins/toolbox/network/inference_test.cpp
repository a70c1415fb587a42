// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>
#include <opencv2/imgproc.hpp>
#include <random>

#include "harness/message_of.hpp"
#include "marrow/toolbox/network/inference.hpp"
#include "written.hpp"

namespace marrow::test::inference_test {

using network::Network, network::read_description;

/// A kernel without symmetry.
const std::vector<float> kKernel{0.1f, 0.2f, -0.3f, 0.4f, 0.5f, 0.6f, -0.7f, 0.8f, 0.9f};

cv::Mat noise(int rows, int columns, unsigned seed = 1) {
  cv::Mat1f image(rows, columns);
  std::mt19937 random(seed);
  for (float& value : image) value = float(random()) / 4294967296.0f;
  return image;
}

std::vector<cv::Mat> maps_of(const Written& written, const std::vector<cv::Mat>& planes) {
  const Network network(read_description(written.file()));
  return network.maps(planes, network.description().outputs[0], Context());
}

class TiledConvolution : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(TiledConvolution, HasNoSeams) {
  const cv::Mat image = noise(GetParam().first, GetParam().second);
  const Written written(Convolution{.weights = kKernel, .bias = {0.25f}}.bytes());
  const cv::Mat map = maps_of(written, {image})[0];
  cv::Mat expected;
  cv::filter2D(image, expected, CV_32F, cv::Mat1f(3, 3, const_cast<float*>(kKernel.data())), {-1, -1}, 0.25,
               cv::BORDER_REFLECT_101);
  ASSERT_EQ(map.size(), image.size());
  EXPECT_LT(cv::norm(map, expected, cv::NORM_INF), 1e-5);
}

INSTANTIATE_TEST_SUITE_P(Sizes, TiledConvolution,
                         testing::Values(std::pair(32, 32), std::pair(24, 24), std::pair(25, 24), std::pair(100, 61),
                                         std::pair(1, 1), std::pair(3, 200), std::pair(97, 1)));

TEST(Inference, GivesTheSameBytesAtAnyNumberOfThreads) {
  const cv::Mat image = noise(300, 211);
  const Written written(Convolution{.weights = kKernel, .bias = {0}}.bytes());
  const auto at = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return maps_of(written, {image})[0];
  };
  const cv::Mat one = at(1), four = at(4);
  EXPECT_EQ(cv::norm(one, four, cv::NORM_INF), 0);
}

TEST(Inference, PlacesAStridedMapAtTheMiddleOfItsPixels) {
  const std::string description = with(kPlain, "activation: none", "activation: none, stride_px: 4");
  // The mean of 4 x 4 pixels.
  const Written written(
      Convolution{.side = 4, .stride = 4, .weights = std::vector<float>(16, 1 / 16.0f), .bias = {0}}.bytes(),
      description);
  cv::Mat1f ramp(70, 50);
  for (int v = 0; v < ramp.rows; ++v)
    for (int u = 0; u < ramp.cols; ++u) ramp(v, u) = float(100 * v + u);
  const cv::Mat1f map = maps_of(written, {ramp})[0];
  ASSERT_EQ(map.size(), cv::Size(13, 18));
  for (int v = 0; v < 17; ++v)
    for (int u = 0; u < 12; ++u)
      EXPECT_NEAR(map(v, u), 100 * (4 * v + 1.5) + 4 * u + 1.5, 1e-2) << "row " << v << ", column " << u;
}

TEST(Inference, AppliesTheActivation) {
  const std::string description = with(kPlain, "edge_strength: {layer: maps, activation: none}",
                                       "classes: {layer: maps, names: [a, b, c], activation: softmax}");
  const Written written(
      Convolution{.side = 1, .weights = {1, 0, 0}, .bias = {0, std::log(2.0f), std::log(3.0f)}}.bytes(), description);
  const std::vector<cv::Mat> maps = maps_of(written, {cv::Mat1f(9, 9, 0.0f)});
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(maps[i].at<float>(4, 5), double(i + 1) / 6, 1e-6);
  const Written sigmoid(Convolution{.side = 1, .weights = {2}, .bias = {0}}.bytes(),
                        with(kPlain, "activation: none", "activation: sigmoid"));
  EXPECT_NEAR(maps_of(sigmoid, {cv::Mat1f(9, 9, 0.5f)})[0].at<float>(4, 5), 1 / (1 + std::exp(-1.0)), 1e-6);
}

std::string fault_of(const std::string& model, const std::string& description = kPlain,
                     const cv::Mat& image = noise(40, 40)) {
  const Written written(model, description);
  return message_of([&] { maps_of(written, {image}); });
}

TEST(Inference, SaysWhatIsWrongWithAModel) {
  const Convolution good{.weights = kKernel, .bias = {0}};
  EXPECT_EQ(fault_of(good.bytes()), "");
  const auto expect = [](const std::string& said, const std::string& part) {
    EXPECT_NE(said.find(part), std::string::npos) << said;
  };
  expect(fault_of(""), "plain.onnx: the file is empty");
  expect(fault_of("PK not a network"), "plain.onnx: is no ONNX model, or a damaged one; export it again");
  expect(fault_of(good.bytes().substr(0, 90)), "is no ONNX model, or a damaged one");
  Convolution unknown = good;
  unknown.type = "Bogus";
  expect(fault_of(unknown.bytes()), "cannot compute its layer 'first_layer' of the type Bogus; export the network");
  expect(fault_of(good.bytes(), with(kPlain, "layer: maps", "layer: map")),
         "has no output 'map', which plain.yaml names; did you mean 'maps'?");
  expect(fault_of(good.bytes(), with(kPlain, "edge_strength: {layer: maps,", "classes: {layer: maps, names: [a, b],")),
         "output 'maps' has the shape 1 x 1 x 32 x 32, but plain.yaml describes 1 x 2 x 32 x 32 (1, channels, rows, "
         "columns)");
  Convolution colours = good;
  colours.channels = 3;
  colours.weights.resize(27);
  expect(fault_of(colours.bytes()),
         "the network does not take a tile of 32 x 32 px with 1 channel, as plain.yaml says");
  Convolution diverged = good;
  diverged.weights[4] = std::nanf("");
  expect(fault_of(diverged.bytes()),
         "has values that are not finite (NaN or infinity); the training may have diverged");
}

}  // namespace marrow::test::inference_test
