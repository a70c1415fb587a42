// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/edges/drawn.hpp"
#include "tests/plugins/toolbox/network/onnx_model.hpp"
#include "tests/plugins/toolbox/network/written.hpp"

namespace marrow::test::network_test {

const Vector2d kDark(83.3, 61.7), kBright(40.2, 90.6);

/// A dark spot whose network value is 1, and a bright one of -0.75.
View spots() {
  return edges::drawn(150, [](double u, double v) {
    const auto spot = [&](const Vector2d& at, double sigma) {
      return std::exp(-0.5 * (Vector2d(u, v) - at).squaredNorm() / (sigma * sigma));
    };
    return 30000 - 20000 * spot(kDark, 4) + 15000 * spot(kBright, 3);
  });
}

/// Heat maps that are the image itself and its negative.
Written network(const std::string& pixels = "pixel_px: 1") {
  std::string text = with(kPlain, "method: fixed, low: 0, high: 1", "method: fixed, low: -30000, high: -10000");
  text = with(text, "pixel_px: 1", pixels);
  text = with(text, "edge_strength: {layer: maps, activation: none}",
              "heat_maps: {layer: maps, names: [dark, bright], activation: none, deviation_factor: 2}");
  return Written(Convolution{.side = 1, .weights = {1, -1}, .bias = {0, 0}}.bytes(), text);
}

Inputs inputs(const Strings& names) {
  Landmarks landmarks;
  for (const std::string& name : names) landmarks.points.push_back({name, {1, 2, 3}});
  List<View> views;
  views.add("frontal", spots());
  return {{"points", item(landmarks)}, {"views", shipped::list(views, "view")}};
}

struct Answer {
  Landmarks landmarks;
  Strings said;
};

Answer found(const Written& written, const Strings& names, Options options = {}) {
  options["network"] = written.file().string();
  Answer answer;
  Context::Hooks hooks;
  hooks.log = [&](std::string_view text, LogLevel) { answer.said.emplace_back(text); };
  answer.landmarks = output<Landmarks>("landmarks.network", "landmarks", inputs(names), options, Context(hooks));
  return answer;
}

class LandmarksNetwork : public testing::TestWithParam<const char*> {};

TEST_P(LandmarksNetwork, SeesThePointsAtTheirPeaks) {
  const Landmarks landmarks = found(network(GetParam()), {"bright", "dark"}, {{"peak_reach", 20}}).landmarks;
  ASSERT_EQ(landmarks.points.size(), 2u);
  ASSERT_EQ(landmarks.seen.size(), 2u);
  EXPECT_EQ(landmarks.seen[0].name, "bright");
  EXPECT_EQ(landmarks.seen[0].view, "frontal");
  EXPECT_LT((landmarks.seen[0].pixel - kBright).norm(), 0.15);
  EXPECT_LT((landmarks.seen[1].pixel - kDark).norm(), 0.15);
  // A Gaussian less a tenth of its height, cut at 0, has a deviation of 0.777 of the Gaussian's: with u = r^2 / 2, the
  // integrals of u (exp(-u) - 0.1) and exp(-u) - 0.1 from 0 to ln 10 are 0.4046 and 0.6697.
  EXPECT_NEAR(landmarks.seen[1].deviation_px, 2 * 0.777 * 4, 0.25);
}

INSTANTIATE_TEST_SUITE_P(PixelSizes, LandmarksNetwork, testing::Values("pixel_px: 1", "pixel_px: 2", "pixel_px: 1.5"));

TEST(LandmarksNetworkNode, LeavesOutWhatItDoesNotSeeOrKnow) {
  const Written written = network();
  const Answer answer = found(written, {"dark", "bright", "patella"}, {{"least", 0.9}});
  ASSERT_EQ(answer.landmarks.seen.size(), 1u) << "the bright one's map reaches 0.75 only";
  EXPECT_EQ(answer.landmarks.seen[0].name, "dark");
  EXPECT_EQ(answer.landmarks.points.size(), 3u);
  EXPECT_EQ(answer.said, Strings{"the network does not know 'patella'; these points are not looked for"});
  const Answer none = found(written, {"bright"}, {{"least", 0.9}});
  EXPECT_TRUE(none.landmarks.seen.empty());
  EXPECT_EQ(none.said, Strings{"the network sees none of the points; is it made for this bone and for "
                               "images like these?"});
}

TEST(LandmarksNetworkNode, SeesTheSameInAMirror) {
  const Landmarks plain = found(network(), {"dark"}).landmarks,
                  mirrored = found(network(), {"dark"}, {{"mirrored", true}}).landmarks;
  ASSERT_EQ(mirrored.seen.size(), 1u);
  EXPECT_LT((mirrored.seen[0].pixel - plain.seen[0].pixel).norm(), 0.05);
}

TEST(LandmarksNetworkNode, RefusesPointsAndNetworksThatDoNotFit) {
  const Written written = network();
  const auto refusal = [&](const Strings& names, const Written& of) {
    return shipped::refusal("landmarks.network", inputs(names), {{"network", of.file().string()}});
  };
  EXPECT_EQ(refusal({"drak"}, written),
            written.file().string() + ": the network knows none of the points; of 'drak': did you mean 'dark'?");
  EXPECT_EQ(refusal({}, written), "there are no points to look for; give their places in the CT");
  const Written edges(Convolution{.side = 1, .weights = {1}, .bias = {0}}.bytes());
  EXPECT_NE(refusal({"dark"}, edges).find("heat_maps"), std::string::npos) << refusal({"dark"}, edges);
}

}  // namespace marrow::test::network_test
