// SPDX-License-Identifier: Apache-2.0
// Photographs of bodies whose colours and borders can be computed by hand.
#include "marrow/simulate/photograph.hpp"
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::photograph_test {

using phantom::CameraArm;
using phantom::Painted;
using phantom::Sensor;
using phantom::Studio;

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
  EXPECT_EQ(message_of([&] {
              taken({block({-5, -700, -5}, {5, 5, 5}, {1, 1, 1})}, even());
            }),
            "a photographed body reaches behind the camera or closer than 10 mm to it");
}

TEST(SimulatePhotograph, ShowsBoneClampAndPlatform) {
  const auto broken = simulated::fracture(simulated::femur({}), {{"height_fraction", 0.4}});
  const auto camera = call("simulate.camera_arm", {},
                           {{"width_px", std::int64_t(320)}, {"height_px", std::int64_t(240)}, {"focal_px", 400.0}});
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

}  // namespace marrow::test::photograph_test
