// SPDX-License-Identifier: Apache-2.0
// Other fragments in the same images: their shadows and their edges are left out.
#include <marrow/domain/features.hpp>

#include "blob_scene.hpp"
#include "other_fragment.hpp"
#include "shipped.hpp"

namespace others_test {

using blob_scene::at;
using blob_scene::BlobProjector;
using marrow::Cost;
using marrow::List;
using marrow::OutlineProjector;
using marrow::RadiographProjector;
using other_fragment::Fragments;
using other_fragment::SquareOutline;
using other_fragment::SquareProjector;
using other_fragment::with_outline;

/// An upright line at u = 60 + x that faces left.
class LineProjector : public OutlineProjector {
 public:
  std::vector<marrow::OutlinePoint> outline(const marrow::Camera&, const marrow::RigidTransform& pose,
                                            double spacing_px) const override {
    std::vector<marrow::OutlinePoint> points;
    for (double v = 20; v < 140; v += spacing_px)
      points.push_back({float(60 + pose.translation_mm.x()), float(v), -1, 0});
    return points;
  }
};

/// The image with another grey value in the square, as if another fragment were there.
marrow::View view_with(double grey) {
  marrow::View view = blob_scene::view_of(50000, 0.02, 0);
  view.image.pixels = view.image.pixels.clone();
  view.image.pixels(cv::Rect(100, 60, 30, 30)).setTo(grey);
  return view;
}

double value(const std::string& node, const shipped::Inputs& inputs, const marrow::RigidTransform& pose,
             const shipped::Options& options) {
  const marrow::Value cost = shipped::call(node, inputs, options).at("cost");
  return cost.as<Cost>().value(pose);
}

TEST(Others, TheirShadowsDoNotCount) {
  const shipped::Options options{{"sigma_steps", 0.0}};
  const std::shared_ptr<const RadiographProjector> own = std::make_shared<const BlobProjector>();
  const Fragments<RadiographProjector> fragments{own, std::make_shared<const SquareProjector>()};
  for (const bool is_outline : {false, true}) {
    const auto with = [&](double grey) {
      const shipped::Inputs inputs{{"projector", marrow::Value::of<RadiographProjector>(own)},
                                   {"views", shipped::list(blob_scene::views_of(view_with(grey)), "view")}};
      return is_outline ? with_outline(inputs, std::make_shared<const SquareOutline>()) : fragments.with(inputs);
    };
    EXPECT_NEAR(value("similarity.normalised_cross_correlation", with(9000), at(2, 1), options),
                value("similarity.normalised_cross_correlation", with(40000), at(2, 1), options), 1e-6);
    shipped::Inputs alone = with(9000);
    alone.erase("others");
    alone.erase(is_outline ? "other_outlines" : "other_projectors");
    EXPECT_GT(value("similarity.normalised_cross_correlation", alone, at(0, 0), options),
              value("similarity.normalised_cross_correlation", with(9000), at(0, 0), options) + 0.05);
  }
}

TEST(Others, TheirShadowsDoNotCountHoweverEachIsDrawn) {
  const Fragments<RadiographProjector> fragments{std::make_shared<const BlobProjector>(),
                                                 std::make_shared<const SquareProjector>()};
  List<OutlineProjector> outlines;
  outlines.add_shared("third", std::make_shared<const SquareOutline>());
  marrow::Pose third;
  third.world_from_model = at(-50, 0);
  List<marrow::Pose> poses;
  poses.add("other", marrow::Pose());
  poses.add("third", third);
  const auto with = [&](double grey) {
    marrow::View view = view_with(grey);
    view.image.pixels(cv::Rect(50, 60, 30, 30)).setTo(grey);
    shipped::Inputs inputs = fragments.with({{"views", shipped::list(blob_scene::views_of(view), "view")}});
    inputs["other_outlines"] = shipped::list(outlines, "fragment");
    inputs["others"] = shipped::list(poses, "fragment");
    return value("similarity.normalised_cross_correlation", inputs, at(2, 1), {{"sigma_steps", 0.0}});
  };
  EXPECT_NEAR(with(9000), with(40000), 1e-6);
}

TEST(Others, OfOutlinesItIsSaidWhatIsMissing) {
  const std::string node = "similarity.normalised_cross_correlation";
  const shipped::Inputs inputs =
      with_outline({{"projector", marrow::Value::of<RadiographProjector>(std::make_shared<const BlobProjector>())},
                    {"views", shipped::list(blob_scene::views_of(blob_scene::view_of()), "view")}},
                   std::make_shared<const SquareOutline>());
  shipped::Inputs some = inputs;
  some.erase("others");
  EXPECT_EQ(shipped::refusal(node, some), "there are projectors of other fragments, but no poses; wire 'others'");
  some = inputs;
  some.erase("other_outlines");
  EXPECT_EQ(shipped::refusal(node, some),
            "there are poses of other fragments, but nothing draws them; wire 'other_projectors'");
  some = inputs;
  List<marrow::Pose> poses;
  poses.add("third", marrow::Pose());
  some["others"] = shipped::list(poses, "fragment");
  EXPECT_EQ(shipped::refusal(node, some),
            "other_outlines has the fragment 'other', but others has no pose of it; give the poses of the same "
            "fragments");
}

TEST(Others, TheirEdgesDoNotCount) {
  // Edges of the own line at 64, and of the other fragment's left border at 100, which is nearer to a line at 90.
  marrow::EdgeMap map{200, 170, {}};
  for (int v = 10; v < 160; ++v) {
    map.pixels.push_back({64, float(v), -1, 0, 1});
    if (v >= 60 && v < 90) map.pixels.push_back({101, float(v), -1, 0, 1});
  }
  List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  const Fragments<OutlineProjector> fragments{std::make_shared<const LineProjector>(),
                                              std::make_shared<const SquareOutline>()};
  shipped::Inputs inputs =
      fragments.with({{"views", shipped::list(blob_scene::views_of(blob_scene::view_of()), "view")},
                      {"edges", shipped::list(edges, "view")}});
  shipped::Options options{{"reach_px", 20.0}, {"estimate_offset", false}};
  const std::string node = "similarity.contour_distance";
  const double worst = value(node, inputs, at(500, 0), options), left_out = value(node, inputs, at(38, 0), options);
  EXPECT_NEAR(left_out, worst, 1e-9) << "near the other fragment's edge alone";
  EXPECT_NEAR(value(node, inputs, at(4, 0), options), 0, 1e-5);
  options["others_reach_px"] = 0.5;  // the edge lies 1 px off
  EXPECT_LT(value(node, inputs, at(38, 0), options), worst - 1);
  inputs.erase("others");
  EXPECT_EQ(shipped::refusal(node, inputs), "there are projectors of other fragments, but no poses; wire 'others'");
}

TEST(Others, BothWaysAndWeights) {
  // Half of the edges lie 3 px off. Every point of the outline has an edge at 0 px, but half of the edges have the
  // outline 3 px away.
  marrow::EdgeMap map{200, 170, {}};
  for (int v = 20; v < 140; ++v) {
    if (v % 2) map.pixels.push_back({64, float(v), -1, 0, 1});
  }
  List<marrow::EdgeMap> edges;
  edges.add("frontal", map);
  shipped::Inputs inputs{{"projector", marrow::Value::of<OutlineProjector>(std::make_shared<const LineProjector>())},
                         {"views", shipped::list(blob_scene::views_of(blob_scene::view_of()), "view")},
                         {"edges", shipped::list(edges, "view")}};
  shipped::Options options{{"reach_px", 6.0}, {"estimate_offset", false}, {"contour_spacing_px", 1.0}};
  const std::string node = "similarity.contour_distance";
  const double worst = std::sqrt(37.0) - 1;
  EXPECT_NEAR(value(node, inputs, at(4, 0), options), 0, 1e-5);
  options["symmetric"] = true;
  EXPECT_NEAR(value(node, inputs, at(4, 0), options), 0.5 * 0.5 * worst, 0.02)
      << "there is only half of the edges that the outline would make";
  EXPECT_NEAR(value(node, inputs, at(500, 0), options), worst, 1e-6);

  // A second view does not show the line. Its weight is 0.
  marrow::EdgeMap none = map;
  for (auto& edge : none.pixels) edge.u_px = 150;
  List<marrow::View> views = blob_scene::views_of(blob_scene::view_of());
  views.add("lateral", blob_scene::view_of());
  edges.add("lateral", none);
  inputs["views"] = shipped::list(views, "view");
  inputs["edges"] = shipped::list(edges, "view");
  options["symmetric"] = false;
  options["weights"] = std::vector<double>{1, 0};
  EXPECT_NEAR(value(node, inputs, at(4, 0), options), 0, 1e-5);
  options["weights"] = std::vector<double>{3, 1};
  EXPECT_NEAR(value(node, inputs, at(4, 0), options), 0.25 * worst, 1e-5);
  options["weights"] = std::vector<double>{1};
  EXPECT_EQ(shipped::refusal(node, inputs, options), "weights has 1 numbers, but there are 2 views; give one for each");
}

}  // namespace others_test
