// SPDX-License-Identifier: Apache-2.0
// A knee that bends, and the bones in it.
#include <gtest/gtest.h>

#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/posture.hpp"
#include "nodes.hpp"

namespace knee_motion_test {

using namespace marrow;
using phantom::Body;
using phantom::ClutteredPhantom;

const ClutteredPhantom& leg() {
  static const ClutteredPhantom made = [] {
    const auto femur = simulated::femur({});
    const auto whole = shipped::call("simulate.whole", {{"bone", shipped::item(femur)}}).at("phantom");
    return shipped::call("simulate.clutter", {{"phantom", whole}}, {{"knee", "mild"}})
        .at("phantom")
        .as<ClutteredPhantom>();
  }();
  return made;
}

List<ClutteredPhantom> moving(const shipped::Options& options) {
  const auto out = shipped::call("simulate.knee_motion", {{"phantom", shipped::item(leg())}}, options);
  const auto postures = out.at("postures").as_list<phantom::Posture>();
  List<ClutteredPhantom> frames;
  for (std::size_t i = 0; i < postures.size(); ++i)
    frames.add(postures.name(i), phantom::in_posture(out.at("phantom").as<ClutteredPhantom>(), &postures[i]));
  return frames;
}

shipped::Outputs bones(const ClutteredPhantom& phantom) {
  return shipped::call("simulate.bones", {{"phantom", shipped::item(phantom)}},
                       {{"bodies", std::vector<std::string>{"tibia"}}});
}

const Body& body(const ClutteredPhantom& phantom, const std::string& name) {
  for (const Body& one : phantom.bodies)
    if (one.name == name) return one;
  throw Error("no body " + name);
}

TEST(KneeMotion, BendsByTheFlexionAskedFor) {
  // Half a period of 1 s at 10 Hz: frame 6 is bent the most, frame 11 is straight again.
  const auto frames = moving({{"frames", std::int64_t(11)},
                              {"frame_rate_hz", 10.0},
                              {"period_s", 1.0},
                              {"flexion_deg", 50.0},
                              {"axial_deg", 0.0},
                              {"swing_deg", 0.0},
                              {"shift_mm", 0.0}});
  EXPECT_EQ(frames.names().front(), "0001");
  const auto truth = [&](std::size_t frame, const char* bone) {
    return bones(frames[frame]).at("truths").as_list<Truth>().find(bone)->world_from_model;
  };
  EXPECT_NEAR(degrees(geodesic_angle_rad(truth(0, "tibia").rotation, truth(5, "tibia").rotation)), 50, 1e-6);
  EXPECT_NEAR(degrees(geodesic_angle_rad(truth(0, "tibia").rotation, truth(10, "tibia").rotation)), 0, 1e-6);
  EXPECT_NEAR(degrees(geodesic_angle_rad(truth(0, "bone").rotation, truth(5, "bone").rotation)), 0, 1e-9);
  const Eigen::Vector3d axis_mm = phantom::knee_axis_at(leg().phantom.bone.outer);
  const Eigen::Vector3d in_ct = inverse(truth(0, "tibia")) * axis_mm;
  EXPECT_LT((truth(5, "tibia") * in_ct - axis_mm).norm(), 1e-6) << "about the axis of the knee";
}

/// If a leg turns inwards, its front moves towards the other leg: for a left leg, to the patient's right.
TEST(KneeMotion, TheLowerLegTurnsInwardsOnBothSides) {
  const auto front_goes_to_left_mm = [](const std::string& side) {
    const auto femur = simulated::femur({{"side", side}, {"resolution_mm", 2.0}});
    const auto whole = shipped::call("simulate.whole", {{"bone", shipped::item(femur)}}).at("phantom");
    const auto phantom = shipped::call("simulate.clutter", {{"phantom", whole}}, {{"knee", "mild"}}).at("phantom");
    const auto postures = shipped::call("simulate.knee_motion", {{"phantom", phantom}},
                                        {{"frames", std::int64_t(6)},
                                         {"frame_rate_hz", 10.0},
                                         {"period_s", 1.0},
                                         {"flexion_deg", 0.0},
                                         {"swing_deg", 0.0},
                                         {"shift_mm", 0.0}})
                              .at("postures")
                              .as_list<phantom::Posture>();
    const RigidTransform turn = postures[5].bodies.at(0).value();  // the tibia at its largest flexion
    return (turn.rotation * Eigen::Vector3d(0, -100, 0)).x();
  };
  EXPECT_NEAR(front_goes_to_left_mm("left"), -100 * std::sin(radians(10)), 1e-6);
  EXPECT_NEAR(front_goes_to_left_mm("right"), 100 * std::sin(radians(10)), 1e-6);
}

TEST(KneeMotion, TruthsAndSurfacesMoveTogether) {
  const auto frames = moving({{"frames", std::int64_t(4)}});
  const auto first = bones(frames[0]).at("truths").as_list<Truth>(),
             last = bones(frames[3]).at("truths").as_list<Truth>();
  const RigidTransform moved = last.find("tibia")->world_from_model * inverse(first.find("tibia")->world_from_model);
  const Mesh &before = body(frames[0], "tibia").surface, &after = body(frames[3], "tibia").surface;
  for (std::size_t i = 0; i < before.vertices_mm.size(); i += 500)
    EXPECT_LT((moved * before.vertices_mm[i] - after.vertices_mm[i]).norm(), 1e-9);
  EXPECT_GT((before.vertices_mm[0] - after.vertices_mm[0]).norm(), 0.1);
}

TEST(KneeMotion, ABlankFrameHasAClosedShutter) {
  const auto frames = moving({{"frames", std::int64_t(5)}, {"blank", std::vector<double>{2, 3}}});
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_EQ(frames[i].bodies.back().name == "shutter", i == 1 || i == 2) << i;
  List<Camera> cameras;
  cameras.add("frontal", shipped::call("camera.carm", {},
                                       {{"names", std::vector<std::string>{"frontal"}},
                                        {"alpha_deg", std::vector<double>{0}},
                                        {"beta_deg", std::vector<double>{0}},
                                        {"width_px", std::int64_t(64)},
                                        {"height_px", std::int64_t(64)},
                                        {"pixel_mm", 4.7}})
                             .at("camera")
                             .as_list<Camera>()[0]);
  const auto views = shipped::call("simulate.cluttered_fluoroscopy",
                                   {{"phantom", shipped::item(frames[1])}, {"cameras", shipped::list(cameras, "view")}})
                         .at("views")
                         .as_list<View>();
  double most = 0;
  cv::minMaxLoc(views[0].image.pixels, nullptr, &most);
  EXPECT_EQ(most, 0);
}

TEST(KneeMotion, AnotherLegCrosses) {
  const auto frames = moving({{"frames", std::int64_t(3)}, {"crossing", true}});
  const double first = body(frames[0], "other tibia").surface.vertices_mm[0].x(),
               last = body(frames[2], "other tibia").surface.vertices_mm[0].x();
  EXPECT_NEAR(last - first, 240, 1e-9);
  EXPECT_FALSE(body(frames[0], "other tibia").in_ct);
}

TEST(KneeMotion, ImagesAndTruthsAreThoseOfThePosture) {
  const auto out = shipped::call("simulate.knee_motion", {{"phantom", shipped::item(leg())}});
  const auto postures = out.at("postures").as_list<phantom::Posture>();
  const auto truths =
      shipped::call("simulate.bones", {{"phantom", out.at("phantom")}, {"posture", shipped::item(postures[7])}},
                    {{"bodies", std::vector<std::string>{"tibia"}}})
          .at("truths")
          .as_list<Truth>();
  const auto expected = bones(moving({})[7]).at("truths").as_list<Truth>();
  for (const char* bone : {"bone", "tibia"})
    EXPECT_EQ(truths.find(bone)->world_from_model.translation_mm, expected.find(bone)->world_from_model.translation_mm)
        << bone;
}

TEST(KneeMotion, APostureBelongsToOnePhantom) {
  phantom::Posture posture;
  posture.world_from_ct.resize(1);
  EXPECT_EQ(
      shipped::refusal("simulate.bones", {{"phantom", shipped::item(leg())}, {"posture", shipped::item(posture)}}),
      "the posture is that of another phantom: it is for 1 fragments and 0 bodies, but the phantom has 1 fragments "
      "and 6 bodies; take both from the same node");
}

TEST(KneeMotion, SaysWhatIsMissing) {
  ClutteredPhantom without = leg();
  without.bodies.clear();
  EXPECT_EQ(shipped::refusal("simulate.knee_motion", {{"phantom", shipped::item(without)}}),
            "simulate.knee_motion: the phantom has no lower leg; add it by simulate.clutter with knee: mild");
  EXPECT_EQ(shipped::refusal("simulate.knee_motion", {{"phantom", shipped::item(leg())}},
                             {{"blank", std::vector<double>{3}}}),
            "simulate.knee_motion: 'blank' takes the first and the last blank frame, as [40, 49]");
  EXPECT_EQ(shipped::refusal("simulate.bones", {{"phantom", shipped::item(leg())}},
                             {{"bodies", std::vector<std::string>{"tibbia"}}}),
            "simulate.bones: the phantom has no body 'tibbia'; did you mean 'tibia'?");
}

TEST(KneeMotion, BonesThatMoveTogetherAreOne) {
  const auto seeds = [](const std::vector<std::string>& bodies) {
    return shipped::call("simulate.bones", {{"phantom", shipped::item(leg())}}, {{"bodies", bodies}})
        .at("seeds")
        .as_list<Seeds>();
  };
  const auto apart = seeds({"tibia", "fibula"}), together = seeds({"tibia+fibula"});
  EXPECT_EQ(together.names(), (std::vector<std::string>{"bone", "tibia"}));
  EXPECT_EQ(together[1].points_mm.size(), apart[1].points_mm.size() + apart[2].points_mm.size());
  EXPECT_EQ(together[1].points_mm.back(), apart[2].points_mm.back());
}

TEST(KneeMotion, SeedsLieInTheBone) {
  const auto found = bones(leg());
  const Seeds* tibia = found.at("seeds").as_list<Seeds>().find("tibia");
  ASSERT_GE(tibia->points_mm.size(), 30u);
  const auto volume = shipped::call("simulate.cluttered_ct", {{"phantom", shipped::item(leg())}},
                                    {{"range_mm", std::vector<double>{-160, 40}}, {"noise_hu", 0.0}}, Context(1))
                          .at("volume")
                          .as<Volume>();
  int dense = 0, inside = 0;
  for (const Eigen::Vector3d& seed : tibia->points_mm) {
    const Eigen::Vector3d index = volume.grid.index_from_point(seed);
    if ((index.array() < 2).any()) continue;
    ++inside;
    dense += sample_trilinear(volume.grid, volume.values, index) > 250;
  }
  EXPECT_GT(inside, 25);
  EXPECT_GE(dense, 0.95 * inside);
}

}  // namespace knee_motion_test
