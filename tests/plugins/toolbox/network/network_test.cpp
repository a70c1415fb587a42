// SPDX-License-Identifier: Apache-2.0
#include <tbb/global_control.h>
#include <opencv2/imgproc.hpp>

#include "marrow/toolbox/network/inference.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "written.hpp"

namespace marrow::test::network_test {

using network::Network, network::Normalisation, network::Output, network::read_description;

std::string fault_of(const std::string& text) {
  const Written written("", text);
  return message_of([&] { read_description(written.file()); });
}

TEST(NetworkDescription, IsRead) {
  const std::string outputs = R"(outputs:
  classes: {layer: kinds, names: [background, bone, metal], activation: softmax}
  heat_maps: {layer: points, names: [a, b], activation: sigmoid, stride_px: 4, deviation_factor: 1.5}
)";
  std::string text = kPlain.substr(0, kPlain.find("outputs:")) + outputs;
  text = with(with(text, "pixel_px: 1", "pixel_mm: 0.8"), "[32, 32]", "[64, 96]");
  const Written written("", with(text, "bone: bright", "bone: dark"));
  const network::Description read = read_description(written.file());
  EXPECT_EQ(read.model.filename(), "plain.onnx");
  EXPECT_EQ(read.good_for, "tests");
  EXPECT_EQ(read.input.size_px, cv::Size(96, 64)) << "rows come first in the file";
  EXPECT_EQ(read.input.pixel_mm, 0.8);
  EXPECT_FALSE(read.input.bone_is_bright);
  ASSERT_EQ(read.outputs.size(), 2u);
  EXPECT_EQ(read.outputs[0].channels(), 3);
  const Output& maps = network::output_of(read, Output::Kind::heat_maps);
  EXPECT_EQ(maps.names, (Strings{"a", "b"}));
  EXPECT_EQ(maps.stride_px, 4);
  EXPECT_EQ(maps.deviation_factor, 1.5);
  EXPECT_HAS(message_of([&] { network::output_of(read, Output::Kind::edge_strength); }),
             "the network has no output 'edge_strength'; it has classes, heat_maps");
  EXPECT_HAS(message_of([&] { network::expect_values(read, {network::Values::hounsfield}, "segment.network"); }),
             "wants values: grey_values, but segment.network can give only hounsfield");
}

struct Fault {
  const char *from, *to, *says;
};
class NetworkDescriptionFaults : public testing::TestWithParam<Fault> {};

TEST_P(NetworkDescriptionFaults, AreSaid) {
  const std::string said = fault_of(with(kPlain, GetParam().from, GetParam().to));
  EXPECT_HAS(said, GetParam().says);
}

INSTANTIATE_TEST_SUITE_P(
    Each, NetworkDescriptionFaults,
    testing::Values(
        Fault{"marrow-network: 1", "marrow-network: 2", "marrow-network"},
        Fault{"licence:", "license:", "did you mean 'licence'?"},
        Fault{"values: grey_values", "values: grey", "expected line_integrals, grey_values, hounsfield; got 'grey'"},
        Fault{"bone: bright", "bone: white", "expected bright, dark; got 'white'"},
        Fault{"pixel_px: 1", "pixel_px: 1\n  pixel_mm: 1",
              "expected one of pixel_mm (its size at the bone) and "
              "pixel_px (in pixels of the image), got both"},
        Fault{"pixel_px: 1", "pixel_px: 0", "pixel_px: expected 0.1 to 100, got 0"},
        Fault{"low: 0, high: 1", "low: 2, high: 1", "high: expected more than low, 2, got 1"},
        Fault{"method: fixed", "method: deviation", "the method 'deviation' takes no numbers"},
        Fault{"[32, 32]", "[32, 32.5]", "expected whole numbers of rows and columns, 8 to 4096, got 32.5"},
        Fault{"overlap_px: 8", "overlap_px: 17", "expected at most half the tile's shorter side, 16, got 17"},
        Fault{"overlap_px: 8", "overlap_px: 8\n  slices: 2", "expected an odd number, so that one is in the middle"},
        Fault{"overlap_px: 8", "overlap_px: 8\n  slices: 3", "only a CT has slices"},
        Fault{"activation: none", "activation: softmax", "only classes exclude each other"},
        Fault{"activation: none", "activation: none, stride_px: 3",
              "must be multiples of the stride of 'edge_strength', 3"},
        Fault{"activation: none", "activation: none, names: [a]", "names"},
        Fault{"edge_strength: {layer: maps, activation: none}", "{}",
              "expected classes, edge_strength, heat_maps; got none"},
        Fault{"edge_strength: {layer: maps,", "classes: {layer: maps, names: [a, a],", "one occurs twice"},
        Fault{"edge_strength: {layer: maps,", "classes: {layer: maps,",
              "expected the names of its channels, got none"}));

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

std::string model_fault(const std::string& model, const std::string& description = kPlain,
                        const cv::Mat& image = noise(40, 40)) {
  const Written written(model, description);
  return message_of([&] { maps_of(written, {image}); });
}

TEST(Inference, SaysWhatIsWrongWithAModel) {
  const Convolution good{.weights = kKernel, .bias = {0}};
  EXPECT_EQ(model_fault(good.bytes()), "");
  const auto expect = [](const std::string& said, const std::string& part) { EXPECT_HAS(said, part); };
  expect(model_fault(""), "plain.onnx: the file is empty");
  expect(model_fault("PK not a network"), "plain.onnx: is no ONNX model, or a damaged one; export it again");
  expect(model_fault(good.bytes().substr(0, 90)), "is no ONNX model, or a damaged one");
  Convolution unknown = good;
  unknown.type = "Bogus";
  expect(model_fault(unknown.bytes()), "cannot compute its layer 'first_layer' of the type Bogus; export the network");
  expect(model_fault(good.bytes(), with(kPlain, "layer: maps", "layer: map")),
         "has no output 'map', which plain.yaml names; did you mean 'maps'?");
  expect(
      model_fault(good.bytes(), with(kPlain, "edge_strength: {layer: maps,", "classes: {layer: maps, names: [a, b],")),
      "output 'maps' has the shape 1 x 1 x 32 x 32, but plain.yaml describes 1 x 2 x 32 x 32 (1, channels, rows, "
      "columns)");
  Convolution colours = good;
  colours.channels = 3;
  colours.weights.resize(27);
  expect(model_fault(colours.bytes()),
         "the network does not take a tile of 32 x 32 px with 1 channel, as plain.yaml says");
  Convolution diverged = good;
  diverged.weights[4] = std::nanf("");
  expect(model_fault(diverged.bytes()),
         "has values that are not finite (NaN or infinity); the training may have diverged");
}

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
  EXPECT_HAS(message_of([&] { columns(0); }), "lies behind the source");
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
  EXPECT_HAS(message_of(masked), "the network has no class 'metals'; did you mean 'metal'?");
}

}  // namespace marrow::test::network_test
