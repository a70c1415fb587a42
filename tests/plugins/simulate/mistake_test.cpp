// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <marrow/domain/case.hpp>

#include "shipped.hpp"

namespace mistake_test {

using namespace marrow;

/// A CT of 4 x 3 x 2 voxels whose values are their indices, one seed, and two views.
Case right() {
  Case made;
  made.ct.grid.size = {4, 3, 2};
  made.ct.grid.spacing_mm = {2, 1, 1};
  made.ct.grid.origin_mm = {10, 0, 0};
  for (int i = 0; i < 24; ++i) made.ct.values.push_back(float(i));
  made.seeds.add("distal", Seeds{"distal", {{12, 1, 1}}, true});
  Truth truth;
  truth.world_from_model.translation_mm = {1, 2, 3};
  made.truth.add("distal", truth);
  for (const char* name : {"frontal", "lateral"}) {
    View view;
    view.name = name;
    view.camera.width_px = 3, view.camera.height_px = 1;
    view.camera.camera_from_world.target = "camera";
    const unsigned short first = name[0] == 'f' ? 10 : 20;
    view.image.pixels = (cv::Mat_<unsigned short>(1, 3) << first, first + 1, first + 2);
    view.camera.camera_from_world.translation_mm.z() = name[0] == 'f' ? 100 : 200;
    made.views.add(name, view);
  }
  return made;
}

shipped::Inputs inputs() {
  const Case made = right();
  return {{"volume", shipped::item(made.ct)},
          {"seeds", shipped::list(made.seeds, "fragment")},
          {"views", shipped::list(made.views, "view")},
          {"truth", shipped::list(made.truth, "fragment")}};
}

Case with(const std::string& mistake, shipped::Options options = {}, const Case* other = nullptr) {
  options["mistake"] = mistake;
  shipped::Inputs given = inputs();
  if (other) {
    given["other_volume"] = shipped::item(other->ct);
    given["other_seeds"] = shipped::list(other->seeds, "fragment");
  }
  const shipped::Outputs out = shipped::call("simulate.mistake", given, options);
  Case made;
  made.ct = out.at("volume").as<Volume>();
  made.seeds = out.at("seeds").as_list<Seeds>();
  made.views = out.at("views").as_list<View>();
  made.truth = out.at("truth").as_list<Truth>();
  return made;
}

int pixel(const Case& made, std::size_t view, int column) {
  return made.views[view].image.pixels.at<unsigned short>(0, column);
}

TEST(SimulateMistake, NoneChangesNothing) {
  const Case made = with("none");
  EXPECT_EQ(made.ct.values, right().ct.values);
  EXPECT_EQ(pixel(made, 1, 2), 22);
  EXPECT_EQ(made.truth[0].world_from_model.translation_mm, Eigen::Vector3d(1, 2, 3));
}

TEST(SimulateMistake, AMirroredCtHasItsSeedsMirroredToo) {
  const Case made = with("mirrored_ct");
  EXPECT_EQ(made.ct.at(0, 1, 1), right().ct.at(3, 1, 1));
  EXPECT_EQ(made.ct.at(2, 2, 0), right().ct.at(1, 2, 0));
  // The seed was at index (1, 1, 1), which is now (2, 1, 1).
  EXPECT_LT((made.seeds[0].points_mm[0] - Eigen::Vector3d(14, 1, 1)).norm(), 1e-12);
  EXPECT_GT(made.truth[0].world_from_model.translation_mm.norm(), 900);
}

TEST(SimulateMistake, MirroredAndSwappedImages) {
  EXPECT_EQ(pixel(with("mirrored_images"), 0, 0), 12);
  const Case swapped = with("swapped_views");
  EXPECT_EQ(swapped.views[0].camera.camera_from_world.translation_mm.z(), 200);
  EXPECT_EQ(swapped.views[1].camera.camera_from_world.translation_mm.z(), 100);
  EXPECT_EQ(pixel(swapped, 0, 0), 10);
  EXPECT_EQ(swapped.truth[0].world_from_model.translation_mm, Eigen::Vector3d(1, 2, 3));
}

TEST(SimulateMistake, AWrongCameraIsOffByTheAmountsTold) {
  const Case made = with("wrong_camera", {{"camera_deg", 5.0}, {"camera_mm", 7.0}});
  EXPECT_EQ(made.views[0].camera.camera_from_world.translation_mm,
            right().views[0].camera.camera_from_world.translation_mm);
  const RigidTransform off =
      inverse(right().views[1].camera.camera_from_world) * made.views[1].camera.camera_from_world;
  EXPECT_NEAR(degrees(vector_from_rotation(off.rotation).norm()), 5, 1e-9);
  EXPECT_NEAR(off.translation_mm.norm(), 7, 1e-9);
}

TEST(SimulateMistake, AnotherBoneComesWithItsSeeds) {
  Case other = right();
  other.ct.values.assign(24, 500.f);
  EXPECT_EQ(with("other_bone", {}, &other).ct.values, other.ct.values);
  EXPECT_EQ(shipped::refusal("simulate.mistake", inputs(), {{"mistake", std::string("other_bone")}}),
            "the mistake other_bone needs the inputs other_volume and other_seeds, the CT of another bone");
}

}  // namespace mistake_test
