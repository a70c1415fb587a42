// SPDX-License-Identifier: Apache-2.0
// What each pixel of an image shows, for boxes whose shadows are known.
#include <gtest/gtest.h>

#include "nodes.hpp"
#include "shapes.hpp"
#include "tests/harness/message_of.hpp"

namespace labels_test {

using namespace marrow;
using phantom::Body;
using phantom::ClutteredPhantom;
namespace test = phantom::test;

Body body(const std::string& material, Mesh surface) {
  Body made;
  made.name = material;
  made.material = material;
  made.surface = std::move(surface);
  return made;
}

/// A box of bone, 40 x 2 x 60 mm, thin along the beam of the frontal view.
ClutteredPhantom box_of_bone() { return {test::whole(test::box({-20, -1, -30}, {20, 1, 30})), {}, {}}; }

cv::Mat classes(const ClutteredPhantom& phantom, const shipped::Options& options = {}, int size_px = 256) {
  List<Camera> cameras;
  cameras.add("frontal", test::camera(0, size_px));
  return shipped::call("simulate.labels",
                       {{"phantom", shipped::item(phantom)}, {"cameras", shipped::list(cameras, "view")}}, options)
      .at("classes")
      .as_list<Image>()[0]
      .pixels;
}

int at(const cv::Mat& image, double x_mm, double z_mm) {
  const Eigen::Vector2d pixel = project(test::camera(0, image.cols), Eigen::Vector3d(x_mm, 0, z_mm));
  return image.at<std::uint8_t>(int(std::lround(pixel.y())), int(std::lround(pixel.x())));
}

TEST(SimulateLabels, BoneIsSeenWhereTheBoxIs) {
  const cv::Mat image = classes(box_of_bone());
  ASSERT_EQ(image.type(), CV_8UC1);
  for (const double side : {-1.0, 1.0}) {
    EXPECT_EQ(at(image, side * 18.5, 0), 80);
    EXPECT_EQ(at(image, side * 21.5, 0), 0);
    EXPECT_EQ(at(image, 0, side * 28.5), 80);
    EXPECT_EQ(at(image, 0, side * 31.5), 0);
  }
}

TEST(SimulateLabels, MetalCountsBeforeAndBehindBoneAndOtherBonesAreBone) {
  ClutteredPhantom phantom = box_of_bone();
  phantom.bodies.push_back(body("steel", test::box({-5, 20, -5}, {5, 22, 5})));              // behind the bone
  phantom.bodies.push_back(body("plastic", test::box({-40, -22, -10}, {-30, -20, 10})));     // background
  phantom.bodies.push_back(body("cancellous bone", test::box({30, -1, -10}, {40, 1, 10})));  // another bone
  phantom.bodies.push_back(body("copper", test::box({30, -1, -60}, {40, 1, -50})));
  phantom.tissues.push_back(body("fat", test::box({-60, -60, -60}, {60, 60, 60})));
  const cv::Mat image = classes(phantom);
  EXPECT_EQ(at(image, 0, 0), 160);
  EXPECT_EQ(at(image, 0, 10), 80);
  EXPECT_EQ(at(image, -35, 0), 0);
  EXPECT_EQ(at(image, 35, 0), 80);
  EXPECT_EQ(at(image, 35, -55), 160);
}

TEST(SimulateLabels, OutsideIsWhereTheCollimatorDarkensTheExportedImage) {
  const int size_px = 128;
  View view;
  view.name = "frontal";
  view.camera = test::camera(0, size_px);
  view.image.pixels = cv::Mat(size_px, size_px, CV_16U, cv::Scalar(10000));
  List<View> views;
  views.add("frontal", view);
  for (const char* level : {"mild", "usual", "bad"}) {
    const shipped::Options options{{"collimator", std::string(level)}, {"collimator_seed", 7}};
    const cv::Mat grey = shipped::call("simulate.export", {{"views", shipped::list(views, "view")}}, options)
                             .at("views")
                             .as_list<View>()[0]
                             .image.pixels;
    const cv::Mat image = classes(box_of_bone(), options, size_px);
    int outside = 0;
    for (int v = 0; v < size_px; ++v)
      for (int u = 0; u < size_px; ++u) {
        const bool is_outside = image.at<std::uint8_t>(v, u) == 240;
        outside += is_outside;
        // Behind a blade 2 % pass, so half of the beam is 0.02 + 0.98 * 0.5 of the grey value.
        ASSERT_EQ(is_outside, grey.at<std::uint16_t>(v, u) < 5100) << level << ": " << u << ", " << v;
      }
    EXPECT_GT(outside, size_px) << level;
    EXPECT_LT(outside, size_px * size_px / 2) << level;
  }
}

TEST(SimulateLabels, SaysWhatReachesToTheSource) {
  ClutteredPhantom phantom = box_of_bone();
  phantom.bodies.push_back(body("steel", test::box({-5, -700, -5}, {5, -500, 5})));
  const std::string message = marrow::test::message_of([&] { classes(phantom); });
  EXPECT_NE(message.find("simulate.labels: something in the beam reaches to "), std::string::npos) << message;
  EXPECT_NE(message.find("it must lie in front of the source"), std::string::npos) << message;
}

}  // namespace labels_test
