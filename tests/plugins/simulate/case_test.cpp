// SPDX-License-Identifier: Apache-2.0
// The chain from a bone to a case, as pipelines/simulate/simulate.yaml wires it, and cases with a mistake.
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::case_test {

using namespace simulated;

struct Chain {
  Phantom phantom;
  Volume volume;
  List<View> views;
};
const Chain& chain() {
  static const Chain made = [] {
    Chain result;
    result.phantom =
        fracture(femur({{"resolution_mm", 2.0}}, 11), {{"height_fraction", 0.3}, {"rotation_deg", Numbers{0, 0, 8}}});
    result.volume = ct(result.phantom, {{"spacing_mm", Numbers{1.2, 1.2, 1.5}}, {"range_mm", Numbers{0, 250}}}, 11);
    result.views = output_list<View>(
        "simulate.fluoroscopy", "views",
        {{"phantom", item(result.phantom)},
         {"cameras", per_view("frontal", simulated::camera(0, 256), "lateral", simulated::camera(90, 256))}},
        {}, Context(11));
    return result;
  }();
  return made;
}

/// The chain's parts, with another CT perhaps.
Inputs parts(const Volume& volume = chain().volume) {
  return {{"volume", item(volume)}, {"views", each_view(chain().views)}, {"phantom", item(chain().phantom)}};
}
Case assemble(const Options& options = {}) { return output<Case>("simulate.case", "case", parts(), options); }

TEST(SimulateCase, HoldsSeedsTruthAndViewsAndNoStart) {
  const Case result = assemble();
  EXPECT_EQ(result.views.names(), (Strings{"frontal", "lateral"}));
  EXPECT_EQ(result.truth.names(), Strings{"distal"});
  EXPECT_TRUE(result.start.empty());
  EXPECT_EQ(result.truth[0].world_from_model.rotation, chain().phantom.fragments[1].world_from_ct.rotation);
  ASSERT_EQ(result.seeds.size(), 2u);
  EXPECT_FALSE(result.seeds.find("proximal")->wanted);
  EXPECT_TRUE(result.seeds.find("distal")->wanted);
  for (const Seeds& seeds : result.seeds) {
    EXPECT_GE(seeds.points_mm.size(), 4u);
    for (const auto& point : seeds.points_mm)
      EXPECT_GT(value_at(result.ct, point), 130) << seeds.fragment << " " << point.transpose();
  }
}

TEST(SimulateCase, ItsPartsAreThoseOfTheCase) {
  const Case whole = assemble({{"start", std::string("exact")}});
  const Outputs parts = call("simulate.case_parts", {{"case", item(whole)}});
  EXPECT_EQ(parts.at("ct").as<Volume>().values, whole.ct.values);
  EXPECT_EQ(parts.at("seeds").as_list<Seeds>().names(), whole.seeds.names());
  EXPECT_EQ(parts.at("views").as_list<View>().names(), whole.views.names());
  EXPECT_EQ(parts.at("start").as_list<Pose>().names(), whole.start.names());
  EXPECT_EQ(parts.at("truth").as_list<Truth>()[0].world_from_model.rotation, whole.truth[0].world_from_model.rotation);
}

TEST(SimulateCase, BothFragmentsCanBeWanted) {
  const Case result = assemble({{"register", Strings{"distal", "proximal"}}});
  EXPECT_EQ(result.truth.names(), (Strings{"proximal", "distal"}));
  EXPECT_TRUE(result.seeds.find("proximal")->wanted);
}

TEST(SimulateCase, StartsAtTheTruthOnlyWhenAsked) {
  const Case result = assemble({{"start", std::string("exact")}});
  ASSERT_EQ(result.start.names(), Strings{"distal"}) << "only fragments that are registered have one";
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
        if (grey(view, u, v) < 9500) lowest = v, ++dark;
    EXPECT_GT(dark, 3000);
    EXPECT_GT(lowest, 190);
    EXPECT_LT(lowest, 250);
  }
}

TEST(SimulateCase, WrongFragmentsAndUncoveredOnesAreExplained) {
  EXPECT_EQ(refusal("simulate.case", parts(), {{"register", Strings{"middle"}}}),
            "simulate.case: the option 'register': the phantom has no fragment 'middle', only proximal, distal");
  const Volume elsewhere = ct(chain().phantom, {{"spacing_mm", Numbers{2, 2, 2}}, {"range_mm", Numbers{200, 300}}});
  EXPECT_EQ(refusal("simulate.case", parts(elsewhere)),
            "simulate.case: fragment 'distal' has no seed within the CT; let simulate.ct cover more of it (range_mm)");
  EXPECT_NE(refusal("simulate.case", parts(Volume{})), "");
}

TEST(SimulateTruth, GivesSeedsIfTheCtIsGiven) {
  const Inputs phantom{{"phantom", item(chain().phantom)}};
  EXPECT_TRUE(call("simulate.truth", phantom).at("seeds").items.empty());
  const auto seeds = output_list<Seeds>("simulate.truth", "seeds", with(phantom, {{"volume", item(chain().volume)}}));
  ASSERT_EQ(seeds.size(), chain().phantom.fragments.size());
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    const Fragment& fragment = chain().phantom.fragments[i];
    EXPECT_EQ(seeds[i].fragment, fragment.name);
    EXPECT_EQ(seeds[i].points_mm, phantom::points_within(chain().volume.grid, fragment.seeds_mm));
  }
}

/// A CT of 4 x 3 x 2 voxels whose values are their indices, one seed, and two views.
Case right() {
  Case made;
  made.ct.grid = grid_at({4, 3, 2}, {10, 0, 0}, {2, 1, 1});
  for (int i = 0; i < 24; ++i) made.ct.values.push_back(float(i));
  made.seeds.add("distal", Seeds{"distal", {{12, 1, 1}}, true});
  made.truth.add("distal", Truth{placed({1, 2, 3})});
  for (const auto& [name, first, distance_mm] : {std::tuple("frontal", 10, 100.0), std::tuple("lateral", 20, 200.0)}) {
    Camera camera;
    camera.width_px = 3, camera.height_px = 1;
    const cv::Mat pixels = image_of<std::uint16_t>(3, 1, [first = first](int u, int) { return first + u; });
    made.views.add(name, view_of(name, before_origin(camera, distance_mm), pixels));
  }
  return made;
}
Inputs right_inputs() {
  const Case made = right();
  return {{"volume", item(made.ct)},
          {"seeds", list(made.seeds, "fragment")},
          {"views", each_view(made.views)},
          {"truth", list(made.truth, "fragment")}};
}
Case with_mistake(const std::string& mistake, const Options& options = {}, const Inputs& other = {}) {
  const Outputs out = call("simulate.mistake", with(right_inputs(), other), with(options, {{"mistake", mistake}}));
  return {out.at("volume").as<Volume>(),
          out.at("seeds").as_list<Seeds>(),
          out.at("views").as_list<View>(),
          {},
          out.at("truth").as_list<Truth>()};
}
const Camera& camera_of(const Case& made, std::size_t view) { return made.views[view].camera; }

TEST(SimulateMistake, NoneChangesNothing) {
  const Case made = with_mistake("none");
  EXPECT_EQ(made.ct.values, right().ct.values);
  EXPECT_EQ(grey(made.views[1], 2, 0), 22);
  EXPECT_EQ(made.truth[0].world_from_model.translation_mm, Vector3d(1, 2, 3));
}

TEST(SimulateMistake, AMirroredCtHasItsSeedsMirroredToo) {
  const Case made = with_mistake("mirrored_ct");
  EXPECT_EQ(made.ct.at(0, 1, 1), right().ct.at(3, 1, 1));
  EXPECT_EQ(made.ct.at(2, 2, 0), right().ct.at(1, 2, 0));
  // The seed was at index (1, 1, 1), which is now (2, 1, 1).
  EXPECT_LT((made.seeds[0].points_mm[0] - Vector3d(14, 1, 1)).norm(), 1e-12);
  EXPECT_GT(made.truth[0].world_from_model.translation_mm.norm(), 900);
}

TEST(SimulateMistake, MirroredAndSwappedImages) {
  EXPECT_EQ(grey(with_mistake("mirrored_images").views[0], 0, 0), 12);
  const Case swapped = with_mistake("swapped_views");
  EXPECT_EQ(camera_of(swapped, 0).camera_from_world.translation_mm.z(), 200);
  EXPECT_EQ(camera_of(swapped, 1).camera_from_world.translation_mm.z(), 100);
  EXPECT_EQ(grey(swapped.views[0], 0, 0), 10);
  EXPECT_EQ(swapped.truth[0].world_from_model.translation_mm, Vector3d(1, 2, 3));
}

TEST(SimulateMistake, AWrongCameraIsOffByTheAmountsTold) {
  const Case made = with_mistake("wrong_camera", {{"camera_deg", 5.0}, {"camera_mm", 7.0}});
  EXPECT_EQ(camera_of(made, 0).camera_from_world.translation_mm,
            camera_of(right(), 0).camera_from_world.translation_mm);
  const RigidTransform off = inverse(camera_of(right(), 1).camera_from_world) * camera_of(made, 1).camera_from_world;
  EXPECT_NEAR(degrees(vector_from_rotation(off.rotation).norm()), 5, 1e-9);
  EXPECT_NEAR(off.translation_mm.norm(), 7, 1e-9);
}

TEST(SimulateMistake, AnotherBoneComesWithItsSeeds) {
  Case other = right();
  other.ct.values.assign(24, 500.f);
  EXPECT_EQ(
      with_mistake("other_bone", {}, {{"other_volume", item(other.ct)}, {"other_seeds", list(other.seeds, "fragment")}})
          .ct.values,
      other.ct.values);
  EXPECT_EQ(refusal("simulate.mistake", right_inputs(), {{"mistake", std::string("other_bone")}}),
            "the mistake other_bone needs the inputs other_volume and other_seeds, the CT of another bone");
}

}  // namespace marrow::test::case_test
