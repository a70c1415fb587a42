// SPDX-License-Identifier: Apache-2.0
// The chain from a bone to a case, as pipelines/simulate/simulate.yaml wires it.
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"

namespace case_test {

using namespace marrow;
using phantom::Phantom;
namespace test = phantom::test;

struct Chain {
  Phantom phantom;
  Volume ct;
  List<View> views;
};

const Chain& chain() {
  static const Chain made = [] {
    Chain result;
    result.phantom = simulated::fracture(simulated::femur({{"resolution_mm", 2.0}}, 11),
                                         {{"height_fraction", 0.3}, {"rotation_deg", std::vector<double>{0, 0, 8}}});
    result.ct = simulated::ct(
        result.phantom, {{"spacing_mm", std::vector<double>{1.2, 1.2, 1.5}}, {"range_mm", std::vector<double>{0, 250}}},
        11);
    List<Camera> cameras;
    cameras.add("frontal", test::camera(0, 256));
    cameras.add("lateral", test::camera(90, 256));
    result.views = simulated::fluoroscopy(result.phantom, cameras, 11);
    return result;
  }();
  return made;
}

/// The case with another CT than the chain's.
Case assemble_with(const Volume& ct, const shipped::Options& options = {}) {
  return shipped::call("simulate.case",
                       {{"volume", shipped::item(ct)},
                        {"views", shipped::list(chain().views, "view")},
                        {"phantom", shipped::item(chain().phantom)}},
                       options)
      .at("case")
      .as<Case>();
}
Case assemble(const shipped::Options& options = {}) { return assemble_with(chain().ct, options); }

TEST(SimulateCase, HoldsSeedsTruthAndViewsAndNoStart) {
  const Case result = assemble();
  EXPECT_EQ(result.views.names(), (std::vector<std::string>{"frontal", "lateral"}));
  EXPECT_EQ(result.truth.names(), std::vector<std::string>{"distal"});
  EXPECT_TRUE(result.start.empty());
  EXPECT_EQ(result.truth[0].world_from_model.rotation, chain().phantom.fragments[1].world_from_ct.rotation);
  ASSERT_EQ(result.seeds.size(), 2u);
  EXPECT_FALSE(result.seeds.find("proximal")->wanted);
  EXPECT_TRUE(result.seeds.find("distal")->wanted);
  for (const Seeds& seeds : result.seeds) {
    EXPECT_GE(seeds.points_mm.size(), 4u);
    for (const auto& point : seeds.points_mm) {
      const Grid& grid = result.ct.grid;
      EXPECT_GT(sample_trilinear(grid, result.ct.values, grid.index_from_point(point)), 130)
          << seeds.fragment << " " << point.transpose();
    }
  }
}

TEST(SimulateCase, ItsPartsAreThoseOfTheCase) {
  const Case whole = assemble({{"start", std::string("exact")}});
  const shipped::Outputs parts = shipped::call("simulate.case_parts", {{"case", shipped::item(whole)}});
  EXPECT_EQ(parts.at("ct").as<Volume>().values, whole.ct.values);
  EXPECT_EQ(parts.at("seeds").as_list<Seeds>().names(), whole.seeds.names());
  EXPECT_EQ(parts.at("views").as_list<View>().names(), whole.views.names());
  EXPECT_EQ(parts.at("start").as_list<Pose>().names(), whole.start.names());
  EXPECT_EQ(parts.at("truth").as_list<Truth>()[0].world_from_model.rotation, whole.truth[0].world_from_model.rotation);
}

TEST(SimulateCase, BothFragmentsCanBeWanted) {
  const Case result = assemble({{"register", std::vector<std::string>{"distal", "proximal"}}});
  EXPECT_EQ(result.truth.names(), (std::vector<std::string>{"proximal", "distal"}));
  EXPECT_TRUE(result.seeds.find("proximal")->wanted);
}

TEST(SimulateCase, StartsAtTheTruthOnlyWhenAsked) {
  EXPECT_TRUE(assemble().start.empty());
  const Case result = assemble({{"start", std::string("exact")}});
  ASSERT_EQ(result.start.names(), std::vector<std::string>{"distal"}) << "only fragments that are registered have one";
  const RigidTransform &start = result.start[0].world_from_model, &truth = result.truth[0].world_from_model;
  EXPECT_EQ(start.rotation, truth.rotation);
  EXPECT_EQ(start.translation_mm, truth.translation_mm);
  EXPECT_EQ(start.target + start.source, "worldct");
}

TEST(SimulateCase, ImagesShowDarkBoneWithinTheField) {
  for (const View& view : chain().views) {
    check_view(view);
    // The condyles are in view and unsaturated: the lowest dark row is inside the image.
    int lowest = 0, dark = 0;
    for (int v = 0; v < 256; ++v)
      for (int u = 64; u < 192; ++u)
        if (view.image.pixels.at<std::uint16_t>(v, u) < 9500) {
          lowest = v;
          ++dark;
        }
    EXPECT_GT(dark, 3000);
    EXPECT_GT(lowest, 190);
    EXPECT_LT(lowest, 250);
  }
}

TEST(SimulateCase, WrongFragmentsAndUncoveredOnesAreExplained) {
  EXPECT_EQ(marrow::test::message_of([] {
              assemble({{"register", std::vector<std::string>{"middle"}}});
            }),
            "simulate.case: the option 'register': the phantom has no fragment 'middle', only proximal, distal");
  const Volume ct = simulated::ct(
      chain().phantom, {{"spacing_mm", std::vector<double>{2, 2, 2}}, {"range_mm", std::vector<double>{200, 300}}});
  EXPECT_EQ(marrow::test::message_of([&] { assemble_with(ct); }),
            "simulate.case: fragment 'distal' has no seed within the CT; let simulate.ct cover more of it (range_mm)");
  EXPECT_NE(marrow::test::message_of([] { assemble_with(Volume{}); }), "");
}

TEST(SimulateTruth, GivesSeedsIfTheCtIsGiven) {
  const shipped::Inputs phantom{{"phantom", shipped::item(chain().phantom)}};
  EXPECT_TRUE(shipped::call("simulate.truth", phantom).at("seeds").items.empty());
  shipped::Inputs both = phantom;
  both["volume"] = shipped::item(chain().ct);
  const auto seeds = shipped::call("simulate.truth", both).at("seeds").as_list<Seeds>();
  ASSERT_EQ(seeds.size(), chain().phantom.fragments.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    EXPECT_EQ(seeds[i].fragment, chain().phantom.fragments[i].name);
    EXPECT_EQ(seeds[i].points_mm, phantom::points_within(chain().ct.grid, chain().phantom.fragments[i].seeds_mm));
  }
}

}  // namespace case_test
