// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::case_test {

using namespace simulated;
using simulated::same;

// The chain from a bone to a case, as pipelines/simulate/simulate.yaml wires it, and cases with a mistake.

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
  const Case whole = assemble({{"start", "exact"}});
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
  const Case result = assemble({{"start", "exact"}});
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
  EXPECT_EQ(refusal("simulate.mistake", right_inputs(), {{"mistake", "other_bone"}}),
            "the mistake other_bone needs the inputs other_volume and other_seeds, the CT of another bone");
}

// Images as a C-arm exports them, and cameras that are not quite right.

View even(int grey, int size_px = 64, const std::string& name = "frontal") {
  return view_of(name, simulated::camera(0, size_px), cv::Mat(size_px, size_px, CV_16U, cv::Scalar(grey)));
}
/// A level of a fault.
Options at(const std::string& fault, const std::string& level) { return {{fault, level}}; }

View exported(const View& view, const Options& options, const View* earlier = nullptr) {
  Inputs inputs{{"views", each_view(view)}};
  if (earlier) inputs["earlier_views"] = each_view(*earlier);
  return output_list<View>("simulate.export", "views", inputs, options)[0];
}
int exported_grey(int grey, const Options& options, const View* earlier = nullptr) {
  return simulated::grey(exported(even(grey), options, earlier), 9, 9);
}
int eight_bit(int grey, const Options& more = {}) {
  const View view = exported(even(grey), with(at("eight_bit", "mild"), more));
  EXPECT_EQ(view.image.pixels.type(), CV_8UC1);
  return view.image.pixels.at<std::uint8_t>(30, 30);
}

TEST(SimulateExport, NothingChangesWhenAllIsOff) {
  const View before = even(500), view = even(12345);
  EXPECT_TRUE(same(exported(view, {}), view));
  EXPECT_TRUE(same(exported(view, {}, &before), view));
  EXPECT_TRUE(same(exported(view, at("lag", "bad")), view)) << "no earlier image, no lag";
}

TEST(SimulateExport, LagMixesTheEarlierImage) {
  const View earlier = even(5000);
  EXPECT_EQ(exported_grey(1000, at("lag", "mild"), &earlier), 1200);   // 0.95 * 1000 + 0.05 * 5000
  EXPECT_EQ(exported_grey(1000, at("lag", "usual"), &earlier), 1600);  // 0.85 * 1000 + 0.15 * 5000
  EXPECT_EQ(exported_grey(1000, at("lag", "bad"), &earlier), 2400);    // 0.65 * 1000 + 0.35 * 5000
}

TEST(SimulateExport, EightBitsWithGamma) {
  EXPECT_EQ(eight_bit(65535), 255);
  EXPECT_EQ(eight_bit(0), 0);
  EXPECT_EQ(eight_bit(16384), 84);  // 255 * 0.25000^0.8 = 84.12
  EXPECT_EQ(eight_bit(6554), 40);   // 255 * 0.10001^0.8 = 40.42
  // Saturated first: (16384 - 0) / 50000 = 0.32768; 255 * 0.32768^0.8 = 104.44.
  EXPECT_EQ(eight_bit(16384, at("saturation", "mild")), 104);
  EXPECT_EQ(eight_bit(60000, at("saturation", "mild")), 255);
}

TEST(SimulateExport, SaturationCutsWhiteAndBlack) {
  EXPECT_EQ(exported_grey(40000, at("saturation", "usual")), 30000);
  EXPECT_EQ(exported_grey(12000, at("saturation", "usual")), 12000);
  EXPECT_EQ(exported_grey(900, at("saturation", "usual")), 1500);
}

TEST(SimulateExport, LocalContrastRaisesSmallDifferences) {
  View view = even(0, 128);
  view.image.pixels = image_of<std::uint16_t>(128, 128, [](int u, int) { return 11500 + 1000 * ((u / 4) % 2); });
  const auto contrast = [&](const std::string& level) {
    const cv::Mat pixels = exported(view, at("eight_bit", level)).image.pixels;
    return pixels.at<std::uint8_t>(64, 70) - pixels.at<std::uint8_t>(64, 66);
  };
  EXPECT_GT(std::abs(contrast("bad")), 1.3 * std::abs(contrast("mild")));
}

TEST(SimulateExport, TheCollimatorHasARimWithHalfShadow) {
  const Options usual = at("collimator", "usual");
  const View view = exported(even(20000, 256), usual);
  const auto grey = [&](int u) { return simulated::grey(view, u, 128); };
  EXPECT_EQ(grey(128), 20000);
  EXPECT_NEAR(grey(0), 400, 200);  // 2 % behind the blade
  int half_shadow = 0, covered = 0;
  for (int u = 0; u < 128; ++u) {
    half_shadow += grey(u) > 1000 && grey(u) < 19000;
    covered += grey(u) <= 10000;
  }
  EXPECT_GE(half_shadow, 4);
  EXPECT_LE(half_shadow, 9);
  EXPECT_GE(covered, 2);
  EXPECT_LE(covered, 0.08 * 256 + 1 + 128 * std::tan(radians(2)));
  EXPECT_TRUE(same(view, exported(even(20000, 256), usual)));
  EXPECT_FALSE(same(view, exported(even(20000, 256), with(usual, {{"collimator_seed", 2}}))));
}

TEST(SimulateExport, BadInputIsExplained) {
  EXPECT_EQ(refusal("simulate.export", {{"views", each_view(even_view("frontal", simulated::camera(0, 64), 7))}}),
            "simulate.export: view 'frontal' is not of 16 bits; give it the views of simulate.fluoroscopy");
  const auto refused = [&](const View& earlier) {
    return refusal("simulate.export", {{"views", each_view(even(100))}, {"earlier_views", each_view(earlier)}},
                   at("lag", "mild"));
  };
  EXPECT_EQ(refused(even(100, 64, "lateral")),
            "simulate.export: there is no earlier image of view 'frontal'; give 'earlier_views' the same views");
  EXPECT_EQ(refused(even(100, 32)), "simulate.export: the earlier image of view 'frontal' has another size");
}

const std::string kFaults = "simulate.camera_faults";
const Camera kExact = simulated::camera(30, 512);

View seen(const std::string& name = "frontal") {
  View view = even(100, 512, name);
  view.camera = kExact;
  return view;
}
Camera stated(int seed, const std::string& level) {
  static const Value views = each_view(seen());
  return output_list<View>(kFaults, "views", {{"views", views}}, {{"camera_seed", seed}, {"severity", level}})[0]
      .camera;
}

TEST(SimulateCameraFaults, HaveTheirRootMeanSquareAndALimit) {
  constexpr int kSeeds = 3000;
  for (const auto& [level, factor] : {std::pair("mild", 0.5), std::pair("usual", 1.0), std::pair("bad", 2.0)}) {
    std::array<double, 4> squares{}, largest{};
    for (int seed = 0; seed < kSeeds; ++seed) {
      const Camera found = stated(seed, level);
      check_camera(found, level);
      EXPECT_NEAR(found.intrinsics(1, 1) / found.intrinsics(0, 0), 1, 1e-12);
      const std::array<double, 4> errors{turn_between_deg(found.camera_from_world, kExact.camera_from_world),
                                         shift_between_mm(found.camera_from_world, kExact.camera_from_world),
                                         100 * (found.intrinsics(0, 0) / kExact.intrinsics(0, 0) - 1),
                                         (found.intrinsics - kExact.intrinsics).col(2).norm()};
      for (std::size_t k = 0; k < errors.size(); ++k) {
        squares[k] += errors[k] * errors[k] / kSeeds;
        largest[k] = std::max(largest[k], std::abs(errors[k]));
      }
    }
    const std::array<double, 4> expected{0.5, 1, 1, 5};
    for (std::size_t k = 0; k < expected.size(); ++k) {
      EXPECT_NEAR(std::sqrt(squares[k]), factor * expected[k], 0.04 * factor * expected[k]) << level << " " << k;
      EXPECT_LE(largest[k], std::sqrt(3.0) * factor * expected[k] * (1 + 1e-6)) << level << " " << k;
    }
  }
}

TEST(SimulateCameraFaults, OnlyTheNamedViewsAreOff) {
  const Inputs two{{"views", each_view(seen("frontal"), seen("lateral"))}};
  const auto found = output_list<View>(kFaults, "views", two, {{"only", Strings{"lateral"}}});
  EXPECT_EQ(found[0].camera.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(found[0].camera.intrinsics, kExact.intrinsics);
  EXPECT_NE(found[1].camera.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(refusal(kFaults, two, {{"only", Strings{"lateal"}}}),
            "only: there is no view 'lateal'; did you mean 'lateral'?");
}

TEST(SimulateCameraFaults, OffLeavesTheCamera) {
  const Camera off = stated(5, "off");
  EXPECT_EQ(off.intrinsics, kExact.intrinsics);
  EXPECT_EQ(off.camera_from_world.rotation, kExact.camera_from_world.rotation);
  EXPECT_EQ(off.camera_from_world.translation_mm, kExact.camera_from_world.translation_mm);
  EXPECT_NE(stated(5, "mild").intrinsics, kExact.intrinsics);
  EXPECT_EQ(stated(5, "mild").intrinsics, stated(5, "mild").intrinsics);
}

}  // namespace marrow::test::case_test
