// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/draw/canvas.hpp"
#include "tests/plugins/render/pictures.hpp"

namespace marrow::test::overlay_test {

using namespace draw;
using pictures::has;

/// A square outline of 40 px about the image point of the model's origin.
class SquareProjector : public OutlineProjector {
 public:
  std::vector<OutlinePoint> outline(const Camera& camera, const RigidTransform& world_from_model,
                                    double) const override {
    const Vector2d c = project(camera, world_from_model.translation_mm);
    std::vector<OutlinePoint> points;
    const auto add = [&](double u, double v, float normal_u, float normal_v) {
      if (u >= 0 && v >= 0 && u < camera.width_px && v < camera.height_px)
        points.push_back({float(u), float(v), normal_u, normal_v, Eigen::Vector3f::Zero()});
    };
    for (int i = -20; i <= 20; ++i) {
      add(c.x() - 20, c.y() + i, -1, 0);
      add(c.x() + 20, c.y() + i, 1, 0);
      add(c.x() + i, c.y() - 20, 0, -1);
      add(c.x() + i, c.y() + 20, 0, 1);
    }
    return points;
  }
};

/// 200 x 100 pixels of mid grey values, 1 px per mm about the centre at the depth of the world's origin.
View view() {
  View view;
  view.name = "frontal";
  view.image.pixels = cv::Mat(100, 200, CV_16U, cv::Scalar(1000));
  view.camera.width_px = 200;
  view.camera.height_px = 100;
  view.camera.intrinsics << 1000, 0, 100, 0, 1000, 50, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 1000};
  return view;
}

RigidTransform at(double x_mm) {
  RigidTransform transform{"world", "ct"};
  transform.translation_mm.x() = x_mm;
  return transform;
}

Pose pose_at(double x_mm) {
  Pose pose;
  pose.world_from_model = at(x_mm);
  return pose;
}

const Options kTripled{{"size_px", std::int64_t{600}}};

/// The picture of a pose; `more` are inputs besides pose, projector and view.
cv::Mat overlay(const Pose& pose, const Inputs& more = {}, const Options& options = kTripled,
                const View& seen = view()) {
  Inputs inputs = more;
  inputs["pose"] = item(pose);
  inputs["projector"] = Value::of<OutlineProjector>(std::make_shared<const SquareProjector>());
  inputs["view"] = item(seen);
  return output<Picture>("render.overlay", "picture", inputs, options).pixels;
}

/// Pixels of a colour anywhere above the legend.
bool contains(const cv::Mat& picture, int height, const cv::Scalar& colour) {
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < picture.cols; ++x)
      if (picture.at<cv::Vec3b>(y, x) == cv::Vec3b(uchar(colour[0]), uchar(colour[1]), uchar(colour[2]))) return true;
  return false;
}

// OpenCV's fonts have only ASCII. The expected replacements of other characters are written by hand.
TEST(Overlay, WritesNamesWithoutTheirMarks) {
  const auto titled = [](const std::string& name) {
    View named = view();
    named.name = name;
    return overlay(pose_at(0), {}, kTripled, named);
  };
  const std::pair<const char*, const char*> names[] = {
      {"H\u00fcfte gro\u00df", "Hufte gross"},
      {"Hu\u0308fte", "Hufte"},
      {"\u0141\u00f3d\u017a \u2013 \u010d\u00c6\u00ff\u017f", "Lodz - cAEys"},
      {"30\u00b0", "30 deg"},
      {"\u5de6 \U0001f9b4\xb0", "? ??"}};
  for (const auto& [name, plain] : names)
    EXPECT_EQ(cv::norm(titled(name), titled(plain), cv::NORM_INF), 0) << name << " is not drawn as " << plain;
  EXPECT_GT(cv::norm(titled("Hufte"), titled("Hu?fte"), cv::NORM_INF), 0);
}

// Pixel u of the image has its centre at 3 u + 1 in a panel of three times the size.
TEST(Overlay, DrawsTheResultWhereTheProjectorSays) {
  const cv::Mat picture = overlay(pose_at(10));
  EXPECT_EQ(picture.type(), CV_8UC3);
  EXPECT_EQ(picture.cols, 600);
  EXPECT_GT(picture.rows, 300);  // the legend lies beneath
  for (cv::Point pixel : {cv::Point(391, 151), cv::Point(271, 151), cv::Point(331, 91), cv::Point(331, 211)})
    EXPECT_TRUE(has(picture, pixel, kSkyBlue)) << pixel;
  EXPECT_TRUE(has(picture, {331, 151}, {128, 128, 128})) << "a constant image is mid grey";
}

TEST(Overlay, OutlinesAreTwoPixelsWide) {
  const cv::Mat picture = overlay(pose_at(10));
  int width_px = 0;
  for (int x = 380; x < 400; ++x) width_px += has(picture, {x, 151}, kSkyBlue);
  EXPECT_GE(width_px, 2);
  EXPECT_LE(width_px, 3);
}

TEST(Overlay, BeforeIsOnTheLeftAndAfterOnTheRight) {
  const cv::Mat picture = overlay(pose_at(40), {{"start", item(pose_at(-40))}, {"truth", item(Truth{at(10)})}});
  EXPECT_EQ(picture.cols, 1200);
  EXPECT_TRUE(has(picture, {241, 151}, kOrange));
  EXPECT_TRUE(has(picture, {391, 151}, kYellow));
  EXPECT_TRUE(has(picture, {600 + 481, 151}, kSkyBlue));
  EXPECT_TRUE(has(picture, {600 + 271, 151}, kYellow));
  EXPECT_FALSE(contains(picture.colRange(0, 600), 300, kSkyBlue));
  EXPECT_FALSE(contains(picture.colRange(600, 1200), 300, kOrange));
}

TEST(Overlay, DrawsEdgesAndShaftLines) {
  const EdgeMap edges{200, 100, {{150, 70, 1, 0, 1}, {std::nanf(""), 0, 1, 0, 1}}};
  ShaftLines lines;
  lines.left = {{20, 30}, {20, 90}};
  lines.right = {{30, 30}, {30, 90}};
  const cv::Mat picture = overlay(pose_at(0), {{"edges", item(edges)}, {"lines", item(lines)}});
  EXPECT_TRUE(has(picture, {61, 151}, kGreen));
  EXPECT_TRUE(has(picture, {91, 151}, kGreen));
  EXPECT_TRUE(has(picture, {451, 211}, {170, 111, 64})) << "halfway between grey and the colour of edges";
}

TEST(Overlay, SaysWhenTheOutlineIsOutside) {
  const cv::Mat picture = overlay(pose_at(500));
  EXPECT_FALSE(contains(picture, 300, kSkyBlue));
  EXPECT_TRUE(pictures::has_legend(picture, 300, {{"result: outside the image", kSkyBlue}}));
}

TEST(Overlay, ZoomShowsTheOutlinesAndAMargin) {
  Options options = kTripled;
  options["zoom"] = true;
  const cv::Mat picture = overlay(pose_at(10), {}, options);
  // All pixels differ, so the margin, where nothing is drawn, tells which part of the image is shown.
  View varied = view();
  for (int v = 0; v < 100; ++v)
    for (int u = 0; u < 200; ++u) varied.image.pixels.at<std::uint16_t>(v, u) = (7919 * u + 1733 * v) % 4001 + 1000;
  const cv::Mat zoomed = overlay(pose_at(10), {}, options, varied);
  const Panel expected = make_panel(varied, {82, 22, 57, 57}, 600, Contrast::local);
  for (const cv::Rect& margin : {cv::Rect(0, 540, 600, 60), cv::Rect(540, 40, 60, 560)})
    EXPECT_TRUE(pictures::same(zoomed(margin), expected.pixels(margin))) << margin;
  EXPECT_EQ(picture.cols, 600);
  EXPECT_TRUE(has(picture, {int((130 - 82 + 0.5) * 600 / 57), 300}, kSkyBlue));
}

TEST(Overlay, ContrastIgnoresNotANumberAndWhatTheMaskHides) {
  View grey = view();
  grey.image.pixels = cv::Mat(100, 200, CV_32F, cv::Scalar(10));
  grey.image.pixels.colRange(100, 200).setTo(20);
  grey.image.pixels.at<float>(0, 0) = std::nanf("");
  grey.image.pixels.row(99).setTo(1e6);
  grey.mask = cv::Mat(100, 200, CV_8U, cv::Scalar(255));
  grey.mask.row(99).setTo(0);
  for (Contrast contrast : {Contrast::linear, Contrast::logarithmic}) {
    const Panel panel = make_panel(grey, whole_image(grey), 200, contrast);
    EXPECT_EQ(panel.pixels.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 0));
  }
  const Panel panel = make_panel(grey, whole_image(grey), 200, Contrast::linear);
  EXPECT_EQ(panel.pixels.at<cv::Vec3b>(50, 50), cv::Vec3b(0, 0, 0));
  EXPECT_EQ(panel.pixels.at<cv::Vec3b>(50, 150), cv::Vec3b(255, 255, 255));
}

TEST(Overlay, SaysWhatIsWrong) {
  const auto message = [](const View& view, const Pose& pose) {
    return message_of([&] { overlay(pose, {}, {}, view); });
  };
  View empty = view();
  empty.image.pixels = cv::Mat();
  EXPECT_EQ(message(empty, {}), "view 'frontal': the image is empty");
  View colour = view();
  colour.image.pixels = cv::Mat(100, 200, CV_8UC3, cv::Scalar::all(0));
  EXPECT_EQ(message(colour, {}), "view 'frontal': the image has 3 channels; an X-ray has one");
  Pose pose;
  pose.world_from_model.translation_mm.x() = std::nan("");
  EXPECT_EQ(message(view(), pose), "pose 'result': the transform has a number that is not finite");
}

}  // namespace marrow::test::overlay_test
