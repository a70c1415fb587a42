// SPDX-License-Identifier: Apache-2.0
// Other fragments in the same images: their shadows and their edges are left out.
#include "marrow/toolbox/match/inputs.hpp"
#include "tests/plugins/similarity/blob_scene.hpp"

namespace marrow::test::others_test {

using namespace blob_scene;

constexpr const char *kCorrelation = "similarity.normalised_cross_correlation",
                     *kContour = "similarity.contour_distance";

/// The image with another grey value in squares, as if other fragments were there.
View view_with(double grey, const std::vector<int>& columns = {100}) {
  View view = view_of(50000, 0.02, 0);
  for (const int column : columns) view.image.pixels(cv::Rect(column, 60, 30, 30)).setTo(grey);
  return view;
}
double correlation(const Inputs& inputs, const RigidTransform& pose = at(2, 1)) {
  return cost_by(kCorrelation, inputs, {{"sigma_steps", 0.0}})->value(pose);
}
/// The blobs beside the square's shadow.
Inputs beside_square(const Inputs& in) {
  const auto own = std::static_pointer_cast<const RadiographProjector>(in.at("projector").data);
  return beside_another<RadiographProjector>(in, own, square_shadow());
}

TEST(Others, TheirShadowsDoNotCount) {
  for (const bool is_outline : {false, true}) {
    const auto told = [&](double grey) {
      const Inputs alone = inputs(view_with(grey));
      return is_outline ? beside_outline(alone) : beside_square(alone);
    };
    EXPECT_NEAR(correlation(told(9000)), correlation(told(40000)), 1e-6);
    EXPECT_GT(correlation(inputs(view_with(9000)), at(0, 0)), correlation(told(9000), at(0, 0)) + 0.05);
  }
}

TEST(Others, TheirShadowsDoNotCountHoweverEachIsDrawn) {
  const auto value = [](double grey) {
    const Inputs two = beside_outline(beside_square(inputs(view_with(grey, {100, 50}))), "third");
    return correlation(with(two, {{"others", per_fragment("other", Pose(), "third", pose_of(at(-50, 0)))}}));
  };
  EXPECT_NEAR(value(9000), value(40000), 1e-6);
}

TEST(Others, OfOutlinesItIsSaidWhatIsMissing) {
  const auto without = [](const std::string& port) {
    Inputs some = beside_outline(inputs());
    some.erase(port);
    return refusal(kCorrelation, some);
  };
  EXPECT_EQ(without("others"), "there are projectors of other fragments, but no poses; wire 'others'");
  EXPECT_EQ(without("other_outlines"),
            "there are poses of other fragments, but nothing draws them; wire 'other_projectors'");
  EXPECT_EQ(
      refusal(kCorrelation, with(beside_outline(inputs()), {{"others", per_fragment("third", Pose())}})),
      "other_outlines has the fragment 'other', but others has no pose of it; give the poses of the same fragments");
}

TEST(Others, TheirEdgesDoNotCount) {
  // Edges of the own line at 64, and of the other fragment's left border at 100, which is nearer to a line at 90.
  const EdgeMap map = together(upright_edges(200, 170, 64, -1, 10, 160), upright_edges(200, 170, 101, -1, 60, 90));
  Inputs told = beside_another({{"views", each_view(view_of())}, {"edges", per_view("frontal", map)}},
                               upright_line(60, 20, 140), square_outline());
  const auto value = [&](double x, const Options& options = {}) {
    return cost_by(kContour, told, with({{"reach_px", 20.0}, {"estimate_offset", false}}, options))->value(at(x, 0));
  };
  EXPECT_NEAR(value(38), value(500), 1e-9) << "near the other fragment's edge alone";
  EXPECT_NEAR(value(4), 0, 1e-5);
  EXPECT_LT(value(38, {{"others_reach_px", 0.5}}), value(500) - 1) << "the edge lies 1 px off";
  told.erase("others");
  EXPECT_EQ(refusal(kContour, told), "there are projectors of other fragments, but no poses; wire 'others'");
}

TEST(Others, BothWaysAndWeights) {
  // Half of the edges lie 3 px off. Every point of the outline has an edge at 0 px, but half of the edges have the
  // outline 3 px away.
  EdgeMap map = upright_edges(200, 170, 64, -1, 20, 140);
  std::erase_if(map.pixels, [](const EdgePixel& edge) { return int(edge.v_px) % 2 == 0; });
  const Inputs one{{"projector", function<OutlineProjector>(upright_line(60, 20, 140))},
                   {"views", each_view(view_of())},
                   {"edges", per_view("frontal", map)}};
  const Options plain{{"reach_px", 6.0}, {"estimate_offset", false}, {"contour_spacing_px", 1.0}};
  const auto value = [&](const Inputs& inputs, double x, const Options& options) {
    return cost_by(kContour, inputs, with(plain, options))->value(at(x, 0));
  };
  const double worst = std::sqrt(37.0) - 1;
  EXPECT_NEAR(value(one, 4, {}), 0, 1e-5);
  EXPECT_NEAR(value(one, 4, {{"symmetric", true}}), 0.5 * 0.5 * worst, 0.02)
      << "there is only half of the edges that the outline would make";
  EXPECT_NEAR(value(one, 500, {{"symmetric", true}}), worst, 1e-6);

  // A second view does not show the line. Its weight is 0.
  EdgeMap none = map;
  for (auto& edge : none.pixels) edge.u_px = 150;
  const Inputs two = with(one, {{"views", per_view("frontal", view_of(), "lateral", view_of())},
                                {"edges", per_view("frontal", map, "lateral", none)}});
  EXPECT_NEAR(value(two, 4, {{"weights", Numbers{1, 0}}}), 0, 1e-5);
  EXPECT_NEAR(value(two, 4, {{"weights", Numbers{3, 1}}}), 0.25 * worst, 1e-5);
  EXPECT_EQ(refusal(kContour, two, with(plain, {{"weights", Numbers{1}}})),
            "weights has 1 numbers, but there are 2 views; give one for each");
}

/// The outline of a rectangle. Two opposite sides belong to it. It may be open above, where the CT ends. It may reach
/// beyond the image, which the contract forbids.
std::shared_ptr<const OutlineProjector> rectangle(int left, int right, int top, int bottom, bool is_open_above) {
  return outline_of([=](const Camera&, const RigidTransform&, double) {
    std::vector<OutlinePoint> points;
    for (int v = top; v <= bottom && is_open_above; ++v) {
      points.push_back({float(left), float(v), -1, 0});
      points.push_back({float(right), float(v), 1, 0});
    }
    for (int u = left; u <= right && !is_open_above; ++u) {
      points.push_back({float(u), float(top), 0, -1});
      points.push_back({float(u), float(bottom), 0, 1});
    }
    return points;
  });
}

TEST(WithoutShadows, FillsAnOutlineInsideTheImageAlone) {
  constexpr int kColumns = 20, kRows = 12;
  View view;
  view.image.pixels = cv::Mat(kRows, kColumns, CV_8U, cv::Scalar(100));
  // Inside the image, beyond one border, beyond the other, and beyond both.
  for (const auto& [first, last] : std::vector<std::pair<int, int>>{{3, 7}, {-5, 4}, {9, 25}, {-5, 25}})
    for (const bool is_open_above : {true, false}) {
      const int left = is_open_above ? first : 4, right = is_open_above ? last : 8, top = is_open_above ? 4 : first,
                bottom = is_open_above ? 8 : last;
      const auto outline = rectangle(left, right, top, bottom, is_open_above);
      const auto masked = match::without_shadows(named("ap", view), {{outline.get(), {}}});
      for (int v = 0; v < kRows; ++v)
        for (int u = 0; u < kColumns; ++u)
          EXPECT_EQ(masked[0].mask.at<std::uint8_t>(v, u) == 0, v >= top && v <= bottom && u >= left && u <= right)
              << first << " to " << last << " at " << u << ' ' << v;
    }
}

}  // namespace marrow::test::others_test
