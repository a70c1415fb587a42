// SPDX-License-Identifier: Apache-2.0
// A bone that moves, and a knee that bends, with the bones in it.
#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/posture.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::motion_test {

using namespace simulated;
using phantom::Posture;

const std::string kMotion = "simulate.knee_motion", kBones = "simulate.bones";

Phantom whole_femur(const Options& options = {}) {
  return output<Phantom>("simulate.whole", "phantom", {{"bone", item(femur(options))}});
}

TEST(BoneMotion, IsAsFarAsAskedHalfAPeriodLater) {
  const Phantom phantom = whole_femur();
  // A period of 1 s at 8 Hz: frame 3 is a quarter of it, frame 5 a half, frame 9 all of it.
  const auto frames = output_list<Posture>("simulate.bone_motion", "postures", {{"phantom", item(phantom)}},
                                           {{"frames", std::int64_t(9)},
                                            {"frame_rate_hz", 8.0},
                                            {"period_s", 1.0},
                                            {"rotation_deg", Numbers{0, 0, 40}},
                                            {"translation_mm", Numbers{0, 0, 7}}});
  ASSERT_EQ(frames.names().back(), "0009");
  const Fragment& rest = phantom.fragments[0];
  const auto motion = [&](std::size_t frame) {
    return motion_between(rest.world_from_ct, frames[frame].world_from_ct[0], rest.frame);
  };
  EXPECT_LT(motion(0).norm(), 1e-9);
  EXPECT_NEAR(degrees(motion(2)[2]), 20, 1e-6);
  EXPECT_NEAR(motion(2)[5], 7, 1e-6);
  EXPECT_NEAR(degrees(motion(4)[2]), 40, 1e-6);
  EXPECT_NEAR(motion(4)[5], 0, 1e-6);
  EXPECT_LT(motion(8).norm(), 1e-6);
  EXPECT_LT(motion(4).head<2>().norm(), 1e-9) << "about the long axis only";
}

const ClutteredPhantom& leg() {
  static const ClutteredPhantom made = cluttered(whole_femur(), {{"knee", "mild"}});
  return made;
}

List<ClutteredPhantom> moving(const Options& options) {
  const auto out = call(kMotion, {{"phantom", item(leg())}}, options);
  const auto postures = out.at("postures").as_list<Posture>();
  List<ClutteredPhantom> frames;
  for (std::size_t i = 0; i < postures.size(); ++i)
    frames.add(postures.name(i), phantom::in_posture(out.at("phantom").as<ClutteredPhantom>(), &postures[i]));
  return frames;
}

template <class T>
List<T> bones(const ClutteredPhantom& phantom, const std::string& port, const Strings& bodies = {"tibia"}) {
  return output_list<T>(kBones, port, {{"phantom", item(phantom)}}, {{"bodies", bodies}});
}
RigidTransform truth_of(const ClutteredPhantom& phantom, const std::string& bone) {
  return bones<Truth>(phantom, "truths").find(bone)->world_from_model;
}

const Body& body_of(const ClutteredPhantom& phantom, const std::string& name) {
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
  const RigidTransform first = truth_of(frames[0], "tibia"), bent = truth_of(frames[5], "tibia");
  EXPECT_NEAR(turn_between_deg(first, bent), 50, 1e-6);
  EXPECT_NEAR(turn_between_deg(first, truth_of(frames[10], "tibia")), 0, 1e-6);
  EXPECT_NEAR(turn_between_deg(truth_of(frames[0], "bone"), truth_of(frames[5], "bone")), 0, 1e-9);
  const Vector3d axis_mm = phantom::knee_axis_at(leg().phantom.bone.outer);
  EXPECT_LT((bent * (inverse(first) * axis_mm) - axis_mm).norm(), 1e-6) << "about the axis of the knee";
}

/// If a leg turns inwards, its front moves towards the other leg: for a left leg, to the patient's right.
TEST(KneeMotion, TheLowerLegTurnsInwardsOnBothSides) {
  const auto front_goes_to_left_mm = [](const std::string& side) {
    const Phantom femur = whole_femur({{"side", side}, {"resolution_mm", 2.0}});
    const auto postures =
        output_list<Posture>(kMotion, "postures", {{"phantom", item(cluttered(femur, {{"knee", "mild"}}))}},
                             {{"frames", std::int64_t(6)},
                              {"frame_rate_hz", 10.0},
                              {"period_s", 1.0},
                              {"flexion_deg", 0.0},
                              {"swing_deg", 0.0},
                              {"shift_mm", 0.0}});
    const RigidTransform turn = postures[5].bodies.at(0).value();  // the tibia at its largest flexion
    return (turn.rotation * Vector3d(0, -100, 0)).x();
  };
  EXPECT_NEAR(front_goes_to_left_mm("left"), -100 * std::sin(radians(10)), 1e-6);
  EXPECT_NEAR(front_goes_to_left_mm("right"), 100 * std::sin(radians(10)), 1e-6);
}

TEST(KneeMotion, TruthsAndSurfacesMoveTogether) {
  const auto frames = moving({{"frames", std::int64_t(4)}});
  const RigidTransform moved = truth_of(frames[3], "tibia") * inverse(truth_of(frames[0], "tibia"));
  const Mesh &before = body_of(frames[0], "tibia").surface, &after = body_of(frames[3], "tibia").surface;
  for (std::size_t i = 0; i < before.vertices_mm.size(); i += 500)
    EXPECT_LT((moved * before.vertices_mm[i] - after.vertices_mm[i]).norm(), 1e-9);
  EXPECT_GT((before.vertices_mm[0] - after.vertices_mm[0]).norm(), 0.1);
}

TEST(KneeMotion, ABlankFrameHasAClosedShutter) {
  const auto frames = moving({{"frames", std::int64_t(5)}, {"blank", Numbers{2, 3}}});
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_EQ(frames[i].bodies.back().name == "shutter", i == 1 || i == 2) << i;
  const auto views =
      output_list<View>("simulate.cluttered_fluoroscopy", "views",
                        {{"phantom", item(frames[1])}, {"cameras", per_view("frontal", simulated::camera(0, 64))}});
  EXPECT_EQ(cv::countNonZero(views[0].image.pixels), 0);
}

TEST(KneeMotion, AnotherLegCrosses) {
  const auto frames = moving({{"frames", std::int64_t(3)}, {"crossing", true}});
  const auto x_mm = [&](std::size_t frame) { return body_of(frames[frame], "other tibia").surface.vertices_mm[0].x(); };
  EXPECT_NEAR(x_mm(2) - x_mm(0), 240, 1e-9);
  EXPECT_FALSE(body_of(frames[0], "other tibia").in_ct);
}

TEST(KneeMotion, ImagesAndTruthsAreThoseOfThePosture) {
  const auto out = call(kMotion, {{"phantom", item(leg())}});
  const auto postures = out.at("postures").as_list<Posture>();
  const auto truths =
      output_list<Truth>(kBones, "truths", {{"phantom", out.at("phantom")}, {"posture", item(postures[7])}},
                         {{"bodies", Strings{"tibia"}}});
  const ClutteredPhantom expected = moving({})[7];
  for (const char* bone : {"bone", "tibia"})
    EXPECT_EQ(truths.find(bone)->world_from_model.translation_mm, truth_of(expected, bone).translation_mm) << bone;
}

TEST(KneeMotion, SaysWhatIsWrong) {
  Posture posture;
  posture.world_from_ct.resize(1);
  const Inputs in{{"phantom", item(leg())}};
  EXPECT_EQ(refusal(kBones, with(in, {{"posture", item(posture)}})),
            "the posture is that of another phantom: it is for 1 fragments and 0 bodies, but the phantom has 1 "
            "fragments and 6 bodies; take both from the same node");
  EXPECT_EQ(refusal(kBones, in, {{"bodies", Strings{"tibbia"}}}),
            "simulate.bones: the phantom has no body 'tibbia'; did you mean 'tibia'?");
  EXPECT_EQ(refusal(kMotion, in, {{"blank", Numbers{3}}}),
            "simulate.knee_motion: 'blank' takes the first and the last blank frame, as [40, 49]");
  ClutteredPhantom without = leg();
  without.bodies.clear();
  EXPECT_EQ(refusal(kMotion, {{"phantom", item(without)}}),
            "simulate.knee_motion: the phantom has no lower leg; add it by simulate.clutter with knee: mild");
}

TEST(KneeMotion, BonesThatMoveTogetherAreOne) {
  const auto apart = bones<Seeds>(leg(), "seeds", {"tibia", "fibula"}),
             together = bones<Seeds>(leg(), "seeds", {"tibia+fibula"});
  EXPECT_EQ(together.names(), (Strings{"bone", "tibia"}));
  EXPECT_EQ(together[1].points_mm.size(), apart[1].points_mm.size() + apart[2].points_mm.size());
  EXPECT_EQ(together[1].points_mm.back(), apart[2].points_mm.back());
}

TEST(KneeMotion, SeedsLieInTheBone) {
  const auto seeds = bones<Seeds>(leg(), "seeds");
  const Seeds* tibia = seeds.find("tibia");
  ASSERT_GE(tibia->points_mm.size(), 30u);
  const auto volume = output<Volume>("simulate.cluttered_ct", "volume", {{"phantom", item(leg())}},
                                     {{"range_mm", Numbers{-160, 40}}, {"noise_hu", 0.0}}, Context(1));
  int dense = 0, inside = 0;
  for (const Vector3d& seed : tibia->points_mm) {
    if ((volume.grid.index_from_point(seed).array() < 2).any()) continue;
    ++inside;
    dense += value_at(volume, seed) > 250;
  }
  EXPECT_GT(inside, 25);
  EXPECT_GE(dense, 0.95 * inside);
}

}  // namespace marrow::test::motion_test
