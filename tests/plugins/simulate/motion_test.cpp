// SPDX-License-Identifier: Apache-2.0
#include "marrow/simulate/knee.hpp"
#include "marrow/simulate/photograph.hpp"
#include "marrow/simulate/posture.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::motion_test {

using namespace simulated;
using phantom::CameraArm, phantom::Painted, phantom::Posture, phantom::Sensor, phantom::Studio;

// A bone that moves, and a knee that bends, with the bones in it.

const std::string kMotion = "simulate.knee_motion", kBones = "simulate.bones";

Phantom whole_femur(const Options& options = {}) {
  return output<Phantom>("simulate.whole", "phantom", {{"bone", item(femur(options))}});
}

TEST(BoneMotion, IsAsFarAsAskedHalfAPeriodLater) {
  const Phantom phantom = whole_femur();
  // A period of 1 s at 8 Hz: frame 3 is a quarter of it, frame 5 a half, frame 9 all of it.
  const auto frames = output_list<Posture>("simulate.bone_motion", "postures", {{"phantom", item(phantom)}},
                                           {{"frames", 9},
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
  const auto frames = moving({{"frames", 11},
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
                             {{"frames", 6},
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
  const auto frames = moving({{"frames", 4}});
  const RigidTransform moved = truth_of(frames[3], "tibia") * inverse(truth_of(frames[0], "tibia"));
  const Mesh &before = body_of(frames[0], "tibia").surface, &after = body_of(frames[3], "tibia").surface;
  for (std::size_t i = 0; i < before.vertices_mm.size(); i += 500)
    EXPECT_LT((moved * before.vertices_mm[i] - after.vertices_mm[i]).norm(), 1e-9);
  EXPECT_GT((before.vertices_mm[0] - after.vertices_mm[0]).norm(), 0.1);
}

TEST(KneeMotion, ABlankFrameHasAClosedShutter) {
  const auto frames = moving({{"frames", 5}, {"blank", Numbers{2, 3}}});
  for (std::size_t i = 0; i < frames.size(); ++i)
    EXPECT_EQ(frames[i].bodies.back().name == "shutter", i == 1 || i == 2) << i;
  const auto views =
      output_list<View>("simulate.cluttered_fluoroscopy", "views",
                        {{"phantom", item(frames[1])}, {"cameras", per_view("frontal", simulated::camera(0, 64))}});
  EXPECT_EQ(cv::countNonZero(views[0].image.pixels), 0);
}

TEST(KneeMotion, AnotherLegCrosses) {
  const auto frames = moving({{"frames", 3}, {"crossing", true}});
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

// Photographs of bodies whose colours and borders can be computed by hand.

CameraArm arm(double k1 = 0) {
  CameraArm made;
  made.device.width_px = 320;
  made.device.height_px = 240;
  made.device.intrinsics = pinhole(400, 320, 240).intrinsics;
  made.device.distortion.k = {k1, 0, 0};
  made.names = {"frontal", "lateral"};
  made.angles_deg = {0, 90};
  return made;
}

/// A sensor whose grey values are the light, without blur and noise.
const Sensor kLinear{0, 1, 0};

const RigidTransform kWorld{"world", "body"};

/// Only even light, so the light from a body is its albedo.
Studio even() { return {{}, 1, {0, 0, 0}}; }

Painted block(const Vector3d& low, const Vector3d& high, const Vector3d& albedo) {
  return {phantom::box(kWorld, low, high), albedo, 0, false};
}

cv::Vec3b at(const Picture& picture, int u, int v) { return picture.pixels.at<cv::Vec3b>(v, u); }

Picture taken(const std::vector<Painted>& bodies, const Studio& studio, double angle_deg = 0, double k1 = 0,
              const Sensor& sensor = kLinear) {
  const CameraArm camera = arm(k1);
  return phantom::photograph(bodies, phantom::camera_at(camera, angle_deg), camera.device.distortion, studio, sensor,
                             1);
}

TEST(Photograph, ABodyIsWhereThePinholeShowsItInItsColour) {
  // A cube of 60 mm whose near face is 600 - 30 mm away: 60 * 400 / 570 = 42.1 px wide.
  const auto cube = block({-30, -30, -30}, {30, 30, 30}, {1, 0.6, 0.2});
  const Picture picture = taken({cube}, even());
  EXPECT_EQ(at(picture, 159, 119), cv::Vec3b(255, 153, 51));
  EXPECT_EQ(at(picture, 159 - 19, 119), cv::Vec3b(255, 153, 51));
  EXPECT_EQ(at(picture, 159 - 23, 119), cv::Vec3b(0, 0, 0));
  double sum = 0;
  for (int u = 0; u < 320; ++u) sum += at(picture, u, 119)[0] / 255.0;
  EXPECT_NEAR(sum, 60 * 400 / 570.0, 0.6);  // two rays in each pixel
}

TEST(Photograph, TheArmTurnsAboutTheVertical) {
  // Red stands at -y, green at +x, blue above.
  const std::vector<Painted> bodies{block({-5, -60, -5}, {5, -50, 5}, {1, 0, 0}),
                                    block({50, -5, -5}, {60, 5, 5}, {0, 1, 0}),
                                    block({-5, -5, 50}, {5, 5, 60}, {0, 0, 1})};
  const Picture front = taken(bodies, even(), 0), side = taken(bodies, even(), 90);
  EXPECT_EQ(at(front, 160, 120), cv::Vec3b(255, 0, 0));                          // red is nearest
  EXPECT_EQ(at(front, 160 + int(55 * 400 / 600.0), 120), cv::Vec3b(0, 255, 0));  // green to the right
  EXPECT_EQ(at(front, 160, 120 - int(55 * 400 / 600.0)), cv::Vec3b(0, 0, 255));  // blue above
  EXPECT_EQ(at(side, 160, 120), cv::Vec3b(0, 255, 0));                           // green is nearest
  EXPECT_EQ(at(side, 160 - int(55 * 400 / 600.0), 120), cv::Vec3b(255, 0, 0));   // red to the left
}

TEST(Photograph, LightFallsOffWithTheCosineAndAShadowIsDark) {
  // The lamp is 60 degrees to the right of the camera's side: cos 60 = 0.5.
  const double angle = radians(60);
  const Studio studio{{{{std::sin(angle), -std::cos(angle), 0}, 1}}, 0.2, {0, 0, 0}};
  const auto wall = block({-100, 0, -80}, {100, 10, 80}, {1, 1, 1});
  EXPECT_NEAR(at(taken({wall}, studio), 160, 120)[0], 255 * (0.2 + 0.5), 1);
  // A post of 20 x 20 mm at 50 mm before the wall throws its shadow 50 tan 60 = 87 mm to the left of it.
  const auto post = block({30, -70, -80}, {50, -50, 80}, {1, 1, 1});
  const Picture picture = taken({wall, post}, studio);
  const auto column = [](double x) { return int(std::lround(159.5 + x * 400 / 600)); };
  EXPECT_NEAR(at(picture, column(40 - 60 * std::tan(angle)), 120)[0], 255 * 0.2, 1);
  EXPECT_NEAR(at(picture, column(80), 120)[0], 255 * 0.7, 1);
}

TEST(Photograph, ABarrelDrawsABorderTowardsTheMiddle) {
  const auto half = block({180, -1, -200}, {400, 0, 200}, {1, 1, 1});
  const auto border = [&](double k1) {
    double dark = 0;
    const Picture picture = taken({half}, even(), 0, k1);
    for (int u = 0; u < 320; ++u) dark += 1 - at(picture, u, 119)[0] / 255.0;
    return dark - 0.5;
  };
  EXPECT_NEAR(border(0), 159.5 + 180 * 400 / 600.0, 0.3);
  // Seen at r (1 + k1 r^2) with r = 0.3: k1 = -0.3 draws 120 px in by 3.24 px.
  EXPECT_NEAR(border(-0.3) - border(0), -3.24, 0.3);
}

TEST(Photograph, TheSensorHasGammaAndNoise) {
  const auto wall = block({-300, 0, -300}, {300, 10, 300}, {0.25, 0.25, 0.25});
  EXPECT_NEAR(at(taken({wall}, even(), 0, 0, {0, 2, 0}), 160, 120)[0], 128, 1);
  cv::Scalar mean, deviation;
  cv::meanStdDev(taken({wall}, even(), 0, 0, {0, 2, 3}).pixels, mean, deviation);
  EXPECT_NEAR(mean[0], 127.5, 0.3);
  EXPECT_NEAR(deviation[1], 3, 0.1);
}

TEST(Photograph, ABodyBehindTheCameraIsRefused) {
  EXPECT_EQ(MESSAGE_OF(taken({block({-5, -700, -5}, {5, 5, 5}, {1, 1, 1})}, even())),
            "a photographed body reaches behind the camera or closer than 10 mm to it");
}

TEST(SimulatePhotograph, ShowsBoneClampAndPlatform) {
  const auto broken = simulated::fracture(simulated::femur({}), {{"height_fraction", 0.4}});
  const auto camera = call("simulate.camera_arm", {}, {{"width_px", 320}, {"height_px", 240}, {"focal_px", 400.0}});
  const auto commands = call("simulate.sweeps", {}, {{"max_rotation_deg", 0.0}}).at("commands");
  const auto motion = call("simulate.hexapod", {{"phantom", item(broken)}, {"commands", commands}});
  const auto photographs = [&](const Options& options, std::uint64_t seed) {
    return output_list<Picture>("simulate.photograph", "photographs",
                                {{"arm", camera.at("arm")},
                                 {"phantom", item(broken)},
                                 {"fragment", item(motion.at("fragment").as_list<Truth>()[0])},
                                 {"platform", item(motion.at("platform").as_list<Truth>()[0])}},
                                options, Context(seed));
  };
  const List<Picture> seen = photographs({{"noise_levels", 0.0}}, 1);
  ASSERT_EQ(seen.names(), (Strings{"frontal", "lateral"}));
  for (const Picture& picture : seen) {
    // Bone is yellowish, the clamp blue, the platform grey; the backdrop is darker than all in red.
    int yellow = 0, blue = 0, grey = 0;
    for (const cv::Vec3b& pixel : cv::Mat3b(picture.pixels)) {
      yellow += pixel[0] > pixel[2] + 15;
      blue += pixel[2] > pixel[0] + 40;
      grey += pixel[0] > 125 && std::abs(pixel[0] - pixel[2]) < 12;
    }
    EXPECT_GT(yellow, 1500);
    EXPECT_GT(blue, 100);
    EXPECT_GT(grey, 300);
  }
  const List<Picture> same = photographs({}, 5), again = photographs({}, 5), other = photographs({}, 6);
  EXPECT_EQ(cv::norm(same[0].pixels, again[0].pixels), 0);
  EXPECT_GT(cv::norm(same[0].pixels, other[0].pixels), 0);
}

}  // namespace marrow::test::motion_test
