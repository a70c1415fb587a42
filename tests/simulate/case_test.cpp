// SPDX-License-Identifier: Apache-2.0
// The chain from a bone to a case, as pipelines/simulate.yaml wires it.
#include <gtest/gtest.h>

#include "all_nodes.hpp"
#include "shapes.hpp"

namespace {

namespace test = phantom::test;

struct Chain {
  Phantom phantom;
  Volume ct;
  List<View> views;
};

const Chain& chain() {
  static const Chain made = [] {
    Context context(11);
    FemurOptions shape;
    shape.resolution_mm = 2;
    FractureOptions broken;
    broken.level = 0.3;
    broken.rotation_deg = {0, 0, 8};
    Chain result;
    result.phantom = fracture(femur(shape, context), broken);
    CtOptions scanner;
    scanner.spacing_mm = {1.2, 1.2, 1.5};
    scanner.range_mm = {0, 250};
    result.ct = scan(result.phantom, scanner, context);
    List<Camera> cameras;
    cameras.add("frontal", test::camera(0, 256));
    cameras.add("lateral", test::camera(90, 256));
    result.views = fluoroscopy(result.phantom, cameras, {}, context);
    return result;
  }();
  return made;
}

TEST(SimulateCase, HoldsSeedsTruthAndViewsAndNoStart) {
  const Case result = assemble(chain().ct, chain().views, chain().phantom, {});
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

TEST(SimulateCase, BothFragmentsCanBeWanted) {
  const Case result = assemble(chain().ct, chain().views, chain().phantom, {{"distal", "proximal"}});
  EXPECT_EQ(result.truth.names(), (std::vector<std::string>{"proximal", "distal"}));
  EXPECT_TRUE(result.seeds.find("proximal")->wanted);
}

TEST(SimulateCase, StartsAtTheTruthOnlyWhenAsked) {
  CaseOptions options;
  EXPECT_TRUE(assemble(chain().ct, chain().views, chain().phantom, options).start.empty());
  options.start = "exact";
  const Case result = assemble(chain().ct, chain().views, chain().phantom, options);
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
  EXPECT_EQ(test::message_of([] { assemble(chain().ct, chain().views, chain().phantom, {{"middle"}}); }),
            "simulate.case: the option 'register' names the fragment 'middle', but there are: proximal, distal");
  CtOptions upper;
  upper.spacing_mm = {2, 2, 2};
  upper.range_mm = {200, 300};
  Context context;
  const Volume ct = scan(chain().phantom, upper, context);
  EXPECT_EQ(test::message_of([&] { assemble(ct, chain().views, chain().phantom, {}); }),
            "simulate.case: fragment 'distal' has no seed within the CT; let simulate.ct cover more of it (range_mm)");
  EXPECT_NE(test::message_of([] { assemble(Volume{}, chain().views, chain().phantom, {}); }), "no error");
}

}  // namespace
