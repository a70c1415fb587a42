// SPDX-License-Identifier: Apache-2.0
#include "tests/harness/node_test.hpp"

namespace marrow::test::scene_test {

/// 100 x 100 pixels, one pixel per mm at the world's origin, 1000 mm from the source, looking along +z.
View view() {
  View view;
  view.name = "frontal";
  view.image.pixels = cv::Mat(100, 100, CV_8U, cv::Scalar(77));
  view.camera.width_px = view.camera.height_px = 100;
  view.camera.intrinsics << 1000, 0, 50, 0, 1000, 50, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 1000};
  return view;
}

Pose at(const Vector3d& translation_mm) {
  Pose pose;
  pose.world_from_model.translation_mm = translation_mm;
  return pose;
}

cv::Mat draw(const List<Mesh>& meshes, const List<Pose>& poses) {
  return output<Picture>("render.scene", "picture",
                         {{"models", shipped::list(meshes, "fragment")},
                          {"poses", shipped::list(poses, "fragment")},
                          {"view", item(view())}},
                         {{"size_px", std::int64_t{200}}})
      .pixels;
}

List<Mesh> two_boxes() {
  List<Mesh> meshes;
  meshes.add("proximal", box({0, 0, 0}, {20, 20, 20}));
  meshes.add("distal", box({0, 0, 0}, {20, 20, 20}));
  return meshes;
}

bool reddish(const cv::Vec3b& pixel) { return pixel[0] > pixel[2] + 40; }  // the first model's colour
bool bluish(const cv::Vec3b& pixel) { return pixel[2] > pixel[0] + 40; }   // the second model's

TEST(Scene, DrawsEachModelAtItsPlace) {
  List<Pose> poses;
  poses.add("distal", at({30, 0, 0}));  // another order: poses go by name
  poses.add("proximal", at({-30, 0, 0}));
  const cv::Mat picture = draw(two_boxes(), poses);
  ASSERT_EQ(picture.cols, 400);
  EXPECT_TRUE(reddish(picture.at<cv::Vec3b>(100, 200 + 40)));
  EXPECT_TRUE(bluish(picture.at<cv::Vec3b>(100, 200 + 160)));
  const cv::Vec3b middle = picture.at<cv::Vec3b>(100, 300), image = picture.at<cv::Vec3b>(100, 40);
  EXPECT_EQ(image, cv::Vec3b(128, 128, 128)) << "the X-ray alone is on the left";
  EXPECT_EQ(middle, cv::Vec3b(64, 64, 64)) << "and dimmed behind the models";
}

TEST(Scene, TheNearerModelHidesTheOther) {
  List<Pose> poses;
  poses.add("proximal", at({0, 0, 100}));
  poses.add("distal", at({0, 0, -100}));
  EXPECT_TRUE(bluish(draw(two_boxes(), poses).at<cv::Vec3b>(100, 300)));
  List<Pose> swapped;
  swapped.add("proximal", at({0, 0, -100}));
  swapped.add("distal", at({0, 0, 100}));
  EXPECT_TRUE(reddish(draw(two_boxes(), swapped).at<cv::Vec3b>(100, 300)));
}

TEST(Scene, ModelsBehindTheSourceAreNotDrawn) {
  List<Pose> poses;
  poses.add("proximal", at({0, 0, -2000}));
  poses.add("distal", at({0, 0, -1000}));  // around the source
  EXPECT_EQ(draw(two_boxes(), poses).cols, 400);
}

TEST(Scene, SaysWhichPoseIsMissing) {
  List<Pose> poses;
  poses.add("distal", at({0, 0, 0}));
  EXPECT_EQ(message_of([&] { draw(two_boxes(), poses); }),
            "fragment 'proximal': there is a mesh, but no pose of that name");
}

}  // namespace marrow::test::scene_test
