// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"
#include "tests/plugins/edges/radiograph.hpp"
#include "tests/plugins/toolbox/network/written.hpp"

namespace marrow::test::template_matching_test {

constexpr int kSize_px = 240;

analytic::Body bone() {
  return {{{0, 0, 60}, {13, 12, 90}}, {{24, -5, -38}, {11, 15, 13}}, {{-22, 8, -32}, {13, 11, 15}}};
}

RigidTransform unmoved() { return analytic::moved_by({0, 0, 0}, {0, 0, 0}); }

/// A view of the bone, exactly drawn. 0.48 mm a pixel at the world's origin.
View view_of(const RigidTransform& world_from_ct) {
  const Camera camera = analytic::c_arm(0, kSize_px, kSize_px, 0.8);
  const auto chords =
      analytic::BodyProjector(bone()).radiograph(camera, world_from_ct, PixelGrid{0, 0, 1, kSize_px, kSize_px});
  return test::view_of("frontal", camera, image_of<std::uint16_t>(kSize_px, kSize_px, [&](int u, int v) {
                         return 50000 * std::exp(-0.02 * chords[std::size_t(v * kSize_px + u)]);
                       }));
}

Inputs inputs(const View& view, const RigidTransform& start) {
  Landmarks points;
  points.points = {{"lateral", {35, -5, -38}}, {"medial", {-35, 8, -32}}};
  return {{"points", item(points)},
          {"views", each_view(view)},
          {"projector", Value::of<RadiographProjector>(std::make_shared<const analytic::BodyProjector>(bone()))},
          {"start", item(pose_of(start))}};
}

Landmarks found(const View& view, const RigidTransform& start, const Options& options = {}) {
  return output<Landmarks>("landmarks.template_matching", "landmarks", inputs(view, start), options);
}

double worst_px(const Landmarks& landmarks, const View& view, const RigidTransform& truth) {
  double worst = 0;
  for (const auto& seen : landmarks.seen)
    for (const auto& point : landmarks.points)
      if (point.name == seen.name)
        worst = std::max(worst, (seen.pixel - project(view.camera, truth * point.model_mm)).norm());
  return worst;
}

/// A start that a turn about the beam and a shift across it lead to: the picture moves and hardly changes.
RigidTransform start_of(const View& view, double turn_deg) {
  const Matrix3d camera_from_world = view.camera.camera_from_world.rotation;
  return analytic::moved_by(radians(turn_deg) * camera_from_world.row(2).transpose(),
                            camera_from_world.transpose() * Vector3d(5, -4, 0));
}

TEST(TemplateMatching, FollowsAShift) {
  const View shown = view_of(unmoved());
  const Landmarks landmarks = found(shown, start_of(shown, 0));
  ASSERT_EQ(landmarks.seen.size(), 2u);
  EXPECT_LT(worst_px(landmarks, shown, unmoved()), 0.7);
  for (const auto& seen : landmarks.seen) {
    EXPECT_GT(seen.deviation_px, 0.01);
    EXPECT_LT(seen.deviation_px, 4);
  }
}

TEST(TemplateMatching, TurnsTheRadiographInItsPlane) {
  const View shown = view_of(unmoved());
  const RigidTransform start = start_of(shown, 8);
  const Landmarks turned = found(shown, start);
  ASSERT_EQ(turned.seen.size(), 2u);
  EXPECT_LT(worst_px(turned, shown, unmoved()), 2.5) << "round condyles look nearly the same when they are turned";
  EXPECT_GT(worst_px(found(shown, start, {{"turn_step_deg", 0.0}}), shown, unmoved()), 3.5);
}

TEST(TemplateMatching, StatesTwiceTheDeviationForAFactorOfTwo) {
  const RigidTransform start = analytic::moved_by({0, 0.05, 0}, {3, 0, 2});
  const Landmarks once = found(view_of(unmoved()), start),
                  twice = found(view_of(unmoved()), start, {{"deviation_factor", 2.0}});
  ASSERT_EQ(once.seen.size(), 2u);
  EXPECT_NEAR(twice.seen[0].deviation_px, 2 * once.seen[0].deviation_px, 1e-9);
}

TEST(TemplateMatching, SeesNothingWhereNothingIsAlike) {
  View empty = view_of(unmoved());
  empty.image.pixels.setTo(30000);
  EXPECT_TRUE(found(empty, unmoved()).seen.empty());
  EXPECT_TRUE(found(view_of(unmoved()), analytic::moved_by({0, 0, 0}, {0, 0, 400})).seen.empty()) << "out of view";
}

TEST(TemplateMatching, RefusesAStartBehindTheSource) {
  const View shown = view_of(unmoved());
  EXPECT_EQ(refusal("landmarks.template_matching",
                    inputs(shown, analytic::moved_by({0, 0, 0}, 2 * source_position_mm(shown.camera)))),
            "view 'frontal': the start puts the points behind the source; is it in the world's frame?");
}

}  // namespace marrow::test::template_matching_test

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
  return {{"points", item(landmarks)}, {"views", per_view("frontal", spots())}};
}

struct Answer {
  Landmarks landmarks;
  Strings said;
};

Answer found(const Written& written, const Strings& names, Options options = {}) {
  options["network"] = written.file().string();
  Heard heard;
  const auto landmarks = output<Landmarks>("landmarks.network", "landmarks", inputs(names), options, heard.context);
  return {landmarks, heard.lines};
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
  EXPECT_EQ(none.said,
            Strings{"the network sees none of the points; is it made for this bone and for images like these?"});
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
