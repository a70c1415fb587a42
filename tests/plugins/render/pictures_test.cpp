// SPDX-License-Identifier: Apache-2.0
#include "tests/plugins/render/pictures.hpp"

namespace marrow::test::pictures_test {

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
  return view_of("frontal", before_origin(pinhole(1000, 200, 100, Vector2d(100, 50)), 1000),
                 cv::Mat(100, 200, CV_16U, cv::Scalar(1000)));
}

RigidTransform at(double x_mm) { return placed({x_mm, 0, 0}); }

Pose pose_at(double x_mm) { return pose_of(at(x_mm)); }

const Options kTripled{{"size_px", 600}};

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
  const Options options = with(kTripled, {{"zoom", true}});
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
  const auto message = [](const View& view, const Pose& pose) { return MESSAGE_OF(overlay(pose, {}, {}, view)); };
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

/// 100 x 100 pixels, one pixel per mm at the world's origin, 1000 mm from the source, looking along +z.
View square_view() { return even_view("frontal", before_origin(pinhole(1000, 100, 100, Vector2d(50, 50)), 1000), 77); }

Pose at(const Vector3d& translation_mm) { return test::pose_at(translation_mm); }

cv::Mat draw(const List<Mesh>& meshes, const List<Pose>& poses) {
  return output<Picture>("render.scene", "picture",
                         {{"models", shipped::list(meshes, "fragment")},
                          {"poses", shipped::list(poses, "fragment")},
                          {"view", item(square_view())}},
                         {{"size_px", 200}})
      .pixels;
}

List<Mesh> two_boxes() {
  return named("proximal", box({0, 0, 0}, {20, 20, 20}), "distal", box({0, 0, 0}, {20, 20, 20}));
}

bool reddish(const cv::Vec3b& pixel) { return pixel[0] > pixel[2] + 40; }  // the first model's colour
bool bluish(const cv::Vec3b& pixel) { return pixel[2] > pixel[0] + 40; }   // the second model's

TEST(Scene, DrawsEachModelAtItsPlace) {
  // In another order: poses go by name.
  const cv::Mat picture = draw(two_boxes(), named("distal", at({30, 0, 0}), "proximal", at({-30, 0, 0})));
  ASSERT_EQ(picture.cols, 400);
  EXPECT_TRUE(reddish(picture.at<cv::Vec3b>(100, 200 + 40)));
  EXPECT_TRUE(bluish(picture.at<cv::Vec3b>(100, 200 + 160)));
  const cv::Vec3b middle = picture.at<cv::Vec3b>(100, 300), image = picture.at<cv::Vec3b>(100, 40);
  EXPECT_EQ(image, cv::Vec3b(128, 128, 128)) << "the X-ray alone is on the left";
  EXPECT_EQ(middle, cv::Vec3b(64, 64, 64)) << "and dimmed behind the models";
}

TEST(Scene, TheNearerModelHidesTheOther) {
  const Pose near = at({0, 0, -100}), far = at({0, 0, 100});
  const auto middle = [](const Pose& proximal, const Pose& distal) {
    return draw(two_boxes(), named("proximal", proximal, "distal", distal)).at<cv::Vec3b>(100, 300);
  };
  EXPECT_TRUE(bluish(middle(far, near)));
  EXPECT_TRUE(reddish(middle(near, far)));
}

TEST(Scene, ModelsBehindTheSourceAreNotDrawn) {
  const List<Pose> poses = named("proximal", at({0, 0, -2000}), "distal", at({0, 0, -1000}));  // one around the source
  EXPECT_EQ(draw(two_boxes(), poses).cols, 400);
}

TEST(Scene, SaysWhichPoseIsMissing) {
  EXPECT_EQ(MESSAGE_OF(draw(two_boxes(), named("distal", at({0, 0, 0})))),
            "fragment 'proximal': there is a mesh, but no pose of that name");
}

ShaftLines lines() {
  ShaftLines lines;
  lines.left = {{30, 10}, {30, 90}};
  lines.right = {{60, 10}, {60, 90}};
  lines.width_mm = 27.3;
  lines.width_deviation_mm = 1.4;
  lines.log_likelihood = -1.25;
  lines.rejected = {{{{40, 10}, {40, 90}}, {{50, 10}, {50, 90}}, "10.0 mm wide: the marrow canal"},
                    {{{80, 10}, {80, 90}}, {{85, 10}, {85, 90}}, "5.0 mm wide: too narrow"}};
  return lines;
}

// Pixel u of the image has its centre at 5 u + 2 in a panel of five times the size.
const Options kFiveTimes{{"size_px", 500}};

cv::Mat shaft(const ShaftLines& lines, const Options& options = kFiveTimes) {
  return output<Picture>("render.shaft", "picture", {{"lines", item(lines)}, {"view", item(square_view())}}, options)
      .pixels;
}

TEST(RenderShaft, ChosenAndRejectedPairsHaveTheirColours) {
  const cv::Mat picture = shaft(lines());
  EXPECT_TRUE(has(picture, {152, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {302, 250}, kSkyBlue));
  EXPECT_TRUE(has(picture, {202, 250}, kOrange));
  EXPECT_TRUE(has(picture, {427, 250}, kOrange));
}

TEST(RenderShaft, TheLineMidwayIsDrawn) { EXPECT_TRUE(has(shaft(lines()), {227, 250}, kSkyBlue)); }

TEST(RenderShaft, DrawsNoMoreRejectedPairsThanAsked) {
  const cv::Mat one = shaft(lines(), with(kFiveTimes, {{"rejected", 1}}));
  EXPECT_TRUE(has(one, {202, 250}, kOrange));
  EXPECT_FALSE(has(one, {427, 250}, kOrange));
  EXPECT_FALSE(has(shaft(lines(), with(kFiveTimes, {{"rejected", 0}})), {202, 250}, kOrange));
}

TEST(RenderShaft, TellsWidthAndScore) {
  const cv::Mat picture = shaft(lines(), {{"size_px", 1000}});
  EXPECT_TRUE(pictures::has_legend(picture, 1000,
                                   {{"chosen: 27.3 +- 1.4 mm wide, log likelihood -1.25", kSkyBlue},
                                    {"rejected 1: 10.0 mm wide: the marrow canal", kOrange},
                                    {"rejected 2: 5.0 mm wide: too narrow", kOrange}}));
}

TEST(RenderShaft, LinesThatAreNotFiniteDrawNothing) {
  ShaftLines broken = lines();
  broken.left.from_px.x() = broken.rejected[0].left.from_px.y() = std::nan("");
  EXPECT_FALSE(shaft(broken).empty());
}

}  // namespace marrow::test::pictures_test
