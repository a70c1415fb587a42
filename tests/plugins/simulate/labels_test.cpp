// SPDX-License-Identifier: Apache-2.0
// What each pixel of an image shows, for boxes whose shadows are known.
#include "tests/plugins/simulate/phantoms.hpp"

namespace marrow::test::labels_test {

using namespace simulated;

/// A box of bone, 40 x 2 x 60 mm, thin along the beam of the frontal view.
ClutteredPhantom box_of_bone() { return {whole(box_between({-20, -1, -30}, {20, 1, 30})), {}, {}}; }

Inputs in_beam(const ClutteredPhantom& phantom, int size_px = 256) {
  return {{"phantom", item(phantom)}, {"cameras", per_view("frontal", simulated::camera(0, size_px))}};
}
cv::Mat classes(const ClutteredPhantom& phantom, const Options& options = {}, int size_px = 256) {
  return output_list<Image>("simulate.labels", "classes", in_beam(phantom, size_px), options)[0].pixels;
}

int at(const cv::Mat& image, double x_mm, double z_mm) {
  const Vector2d pixel = project(simulated::camera(0, image.cols), Vector3d(x_mm, 0, z_mm));
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
  phantom.bodies.push_back(body("steel", box_between({-5, 20, -5}, {5, 22, 5})));              // behind the bone
  phantom.bodies.push_back(body("plastic", box_between({-40, -22, -10}, {-30, -20, 10})));     // background
  phantom.bodies.push_back(body("cancellous bone", box_between({30, -1, -10}, {40, 1, 10})));  // another bone
  phantom.bodies.push_back(body("copper", box_between({30, -1, -60}, {40, 1, -50})));
  phantom.tissues.push_back(body("fat", box_between({-60, -60, -60}, {60, 60, 60})));
  const cv::Mat image = classes(phantom);
  EXPECT_EQ(at(image, 0, 0), 160);
  EXPECT_EQ(at(image, 0, 10), 80);
  EXPECT_EQ(at(image, -35, 0), 0);
  EXPECT_EQ(at(image, 35, 0), 80);
  EXPECT_EQ(at(image, 35, -55), 160);
}

TEST(SimulateLabels, OutsideIsWhereTheCollimatorDarkensTheExportedImage) {
  const int size_px = 128;
  const View view =
      view_of("frontal", simulated::camera(0, size_px), cv::Mat(size_px, size_px, CV_16U, cv::Scalar(10000)));
  for (const char* level : {"mild", "usual", "bad"}) {
    const Options options{{"collimator", std::string(level)}, {"collimator_seed", 7}};
    const View exported = output_list<View>("simulate.export", "views", {{"views", each_view(view)}}, options)[0];
    const cv::Mat image = classes(box_of_bone(), options, size_px);
    int outside = 0;
    for (int v = 0; v < size_px; ++v)
      for (int u = 0; u < size_px; ++u) {
        const bool is_outside = image.at<std::uint8_t>(v, u) == 240;
        outside += is_outside;
        // Behind a blade 2 % pass, so half of the beam is 0.02 + 0.98 * 0.5 of the grey value.
        ASSERT_EQ(is_outside, grey(exported, u, v) < 5100) << level << ": " << u << ", " << v;
      }
    EXPECT_GT(outside, size_px) << level;
    EXPECT_LT(outside, size_px * size_px / 2) << level;
  }
}

TEST(SimulateLabels, SaysWhatReachesToTheSource) {
  ClutteredPhantom phantom = box_of_bone();
  phantom.bodies.push_back(body("steel", box_between({-5, -700, -5}, {5, -500, 5})));
  const std::string message = refusal("simulate.labels", in_beam(phantom));
  EXPECT_NE(message.find("simulate.labels: something in the beam reaches to "), std::string::npos) << message;
  EXPECT_NE(message.find("it must lie in front of the source"), std::string::npos) << message;
}

}  // namespace marrow::test::labels_test
