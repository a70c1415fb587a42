// SPDX-License-Identifier: Apache-2.0
#include "plugins/shaft/hough_pairs.cpp"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "edges/radiograph.hpp"
#include "initial/tube.hpp"
#include "shaft/find_edges.hpp"

namespace {

template <class Function>
std::string error_of(Function function) {
  try {
    function();
  } catch (const marrow::Error& error) {
    return error.what();
  }
  return "no error";
}

View empty_view(int size = 512) {
  View view;
  view.name = "frontal";
  view.camera = radiograph::camera(0, size);
  view.image.pixels = cv::Mat(size, size, CV_16U, cv::Scalar(1000));
  return view;
}

/// A view that is darker between two columns.
View dark_between(int from_u, int to_u) {
  View view = empty_view();
  view.image.pixels.colRange(from_u, to_u) = 500;
  return view;
}

/// Adds exact edge pixels along a segment, one each pixel, with the bright side towards `bright`.
void draw(EdgeMap& edges, const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Eigen::Vector2d& bright) {
  const Eigen::Vector2d along = (to - from).normalized();
  Eigen::Vector2d normal(-along.y(), along.x());
  if (normal.dot(bright) < 0) normal = -normal;
  for (double s = 0; s <= (to - from).norm(); s += 1) {
    const Eigen::Vector2d p = from + s * along;
    edges.pixels.push_back({float(p.x()), float(p.y()), float(normal.x()), float(normal.y()), 100});
  }
}

EdgeMap no_edges() {
  return {512, 512, {}};
}
const Eigen::Vector2d kLeft(-1, 0), kRight(1, 0);

/// Angle and offset of the plane that two borders span against the exact one.
void check_against_truth(const ShaftLines& lines, const View& view, const radiograph::Cylinder& bone) {
  const auto exact = tube::borders(view.camera, bone.point, bone.direction, bone.radius_mm, 100, 400);
  for (const auto& [found, truth] : {std::pair(lines.left, exact.left), std::pair(lines.right, exact.right)}) {
    const Eigen::Vector2d a = found.to_px - found.from_px, b = truth.to_px - truth.from_px;
    EXPECT_LT(marrow::degrees(std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)))), 0.15);
  }
  const auto middle = [](const ShaftLines& s, double v) {
    double sum = 0;
    for (const marrow::LineSegment* border : {&s.left, &s.right})
      sum += border->from_px.x() + (v - border->from_px.y()) / (border->to_px.y() - border->from_px.y()) *
                                       (border->to_px.x() - border->from_px.x());
    return sum / 2;
  };
  std::printf("  middle off by %.3f and %.3f px, width %.2f of %.2f mm\n", middle(lines, 100) - middle(exact, 100),
              middle(lines, 400) - middle(exact, 400), lines.width_mm, 2 * bone.radius_mm);
  EXPECT_NEAR(middle(lines, 100), middle(exact, 100), 0.3);
  EXPECT_NEAR(middle(lines, 400), middle(exact, 400), 0.3);
}

TEST(HoughPairs, FindsTheShaftOfARadiographAndRejectsCanalAndThigh) {
  for (double photons : {1000.0, 5000.0, 0.0})
    for (double angle : {0.0, 90.0}) {
      const auto scene = radiograph::shaft({5, 3, 0}, {0.08, -0.05, 1});
      const View view =
          radiograph::image(angle == 0 ? "frontal" : "lateral", radiograph::camera(angle), scene, photons, 11);
      const EdgeMap edges = find_edges(view);
      const auto before = std::chrono::steady_clock::now();
      const ShaftLines lines = hough_pairs(edges, view, Options{});
      std::printf("%.0f photons: %.1f ms\n", photons,
                  std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count());
      EXPECT_NEAR(lines.width_mm, 28, 1.5);
      EXPECT_GT((lines.left.to_px - lines.left.from_px).norm(), 400);
      EXPECT_GT(lines.left.to_px.y(), lines.left.from_px.y());
      EXPECT_GT(lines.left.from_px.x(), lines.right.from_px.x());  // on the left when looking down the image
      check_against_truth(lines, view, scene.cylinders[1]);
      const auto said = [&](const std::string& words) {
        return std::any_of(lines.rejected.begin(), lines.rejected.end(),
                           [&](const auto& r) { return r.reason.find(words) != std::string::npos; });
      };
      if (photons != 1000) {
        EXPECT_TRUE(said("it is darker outside than inside, as a canal"));
      }
      EXPECT_TRUE(said("is not that of a shaft (28.5 +- 3.3, 30.3 +- 3.1 mm, at most 3 deviations)"));
    }
}

TEST(HoughPairs, EndsWhereOneBorderEnds) {
  EdgeMap edges = no_edges();  // 85 px are 29.9 mm; condyles bend away below v = 300 on one side
  draw(edges, {200, 20}, {200, 480}, kLeft);
  draw(edges, {285, 20}, {285, 300}, kRight);
  draw(edges, {286, 301}, {380, 380}, kRight);
  const ShaftLines lines = hough_pairs(edges, dark_between(200, 285), Options{});
  EXPECT_NEAR(lines.left.from_px.y(), 20, 2);
  EXPECT_NEAR(lines.left.to_px.y(), 300, 6);
  EXPECT_NEAR(lines.left.from_px.x(), 285, 0.01);
  EXPECT_NEAR(lines.right.to_px.x(), 200, 0.01);
  EXPECT_NEAR(lines.width_mm, 85 * 0.6 * 300 / 512, 0.01);
}

TEST(HoughPairs, AllowsATaperAndPrefersTheLikelierWidth) {
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {195, 400}, kLeft);
  draw(edges, {283, 20}, {290, 400}, kRight);
  draw(edges, {300, 20}, {307, 400}, kRight);  // 36 mm: allowed, but less likely
  const ShaftLines lines = hough_pairs(edges, dark_between(200, 285), Options{});
  EXPECT_NEAR(lines.width_mm, 89 * 0.6 * 300 / 512, 0.2);
  ASSERT_FALSE(lines.rejected.empty());
  EXPECT_NE(lines.rejected[0].reason.find("its log-likelihood of "), std::string::npos);
  EXPECT_NE(lines.rejected[0].reason.find(" is below the best one's "), std::string::npos);
}

// A bowed shaft has many lines; their pairs must not crowd the shaft of a second fragment out of the list.
TEST(HoughPairs, ListsTheShaftOfASecondFragment) {
  EdgeMap edges = no_edges();
  const auto bow = [](double v) { return 0.0008 * (v - 150) * (v - 150); };
  for (double v = 10; v < 300; v += 10)
    for (const auto& [u, side] : {std::pair(200.0, kLeft), std::pair(285.0, kRight)})
      draw(edges, {u + bow(v), v}, {u + bow(v + 10), v + 10}, side);
  draw(edges, {203, 360}, {196, 470}, kLeft);
  draw(edges, {282, 360}, {289, 470}, kRight);
  const ShaftLines lines = hough_pairs(edges, dark_between(200, 285), Options{});
  EXPECT_LT(lines.left.to_px.y(), 310);
  int candidates = 0, in_second = 0;
  for (const auto& pair : lines.rejected) {
    if (pair.reason.find(" is below the best one's ") == std::string::npos) continue;
    ++candidates;
    in_second += pair.left.from_px.y() > 350;
  }
  std::printf("%d candidates, %d of them of the second fragment\n", candidates, in_second);
  EXPECT_GE(in_second, 1);
  EXPECT_LE(candidates, 3);
}

TEST(HoughPairs, ToleratesGapsUpToTheLimit) {
  EdgeMap edges = no_edges();
  for (double v = 20; v < 400; v += 60) {  // gaps of 20 px = 7 mm
    draw(edges, {200, v}, {200, v + 40}, kLeft);
    draw(edges, {285, v}, {285, v + 40}, kRight);
  }
  EXPECT_NEAR(hough_pairs(edges, dark_between(200, 285), Options{}).left.to_px.y(), 420, 3);
}

TEST(HoughPairs, SaysWhyThereIsNoPair) {
  const std::string advice = "; look at the edges, and set the edge detector's thresholds or this bone's width_mm";
  EdgeMap edges = no_edges();
  draw(edges, {240, 20}, {240, 400}, kRight);  // the canal's polarity
  draw(edges, {275, 20}, {275, 400}, kLeft);
  EXPECT_EQ(error_of([&] { hough_pairs(edges, empty_view(), Options{}); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because it is darker outside than "
            "inside, as a canal or "
            "a gap between bones is (12.3 mm wide)" +
                advice);
  edges = no_edges();
  draw(edges, {40, 20}, {40, 400}, kLeft);  // the thigh's outline
  draw(edges, {440, 20}, {440, 400}, kRight);
  EXPECT_EQ(error_of([&] { hough_pairs(edges, empty_view(), Options{}); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because its width of 140.6 mm is "
            "not that of a shaft "
            "(28.5 +- 3.3, 30.3 +- 3.1 mm, at most 3 deviations)" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);  // of a shaft's width, but the dark is elsewhere
  draw(edges, {285, 20}, {285, 400}, kRight);
  EXPECT_EQ(error_of([&] { hough_pairs(edges, dark_between(270, 330), Options{}); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because it is not darker than what "
            "lies beside it (mean grey "
            "value 917 inside, 500 and 1000 outside)" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  draw(edges, {285, 380}, {285, 500}, kRight);
  EXPECT_EQ(error_of([&] { hough_pairs(edges, empty_view(), Options{}); }),
            "view 'frontal': no shaft pair found: 2 lines, best candidate rejected because its borders run side by "
            "side for 7 mm only, of 25 mm "
            "wanted" +
                advice);
  edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  EXPECT_EQ(error_of([&] { hough_pairs(edges, empty_view(), Options{}); }),
            "view 'frontal': no shaft pair found: 1 lines, none of which run side by side" + advice);
}

TEST(HoughPairs, SaysWhatIsWrongWithItsInputs) {
  EXPECT_EQ(error_of([&] { hough_pairs(no_edges(), empty_view(), Options{}); }),
            "view 'frontal': the edge map is empty, so there is no shaft in it; look at the image, and lower the "
            "thresholds of the edge "
            "detector");
  EdgeMap edges = no_edges();
  draw(edges, {200, 20}, {200, 400}, kLeft);
  EXPECT_EQ(
      error_of([&] { hough_pairs(edges, empty_view(256), Options{}); }),
      "view 'frontal': the edge map is for 512 x 512 pixels, the view has 256 x 256; wire the edges of this view");
  Options options;
  options.width_deviation_mm = {3};
  EXPECT_EQ(error_of([&] { hough_pairs(edges, empty_view(), options); }),
            "width_mm has 2 numbers and width_deviation_mm 1; give one deviation for each width");
  View behind = empty_view();
  behind.camera.camera_from_world.translation_mm = {0, 0, -600};
  EXPECT_EQ(error_of([&] { hough_pairs(edges, behind, Options{}); }),
            "view 'frontal': the world's origin, the isocentre, does not lie in front of the X-ray source");
}

// A real knee (data of Brown University, see the data folder's README): the distal femur runs from the middle to the
// upper left.
TEST(HoughPairs, FindsTheFemurOfARealKnee) {
  const std::string path = MARROW_SOURCE_DIR "/../shared/data/knee/images/L_Hop_Cam2_001_UND.0138.tif";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the real knee is not here: " << path;
  View view;
  view.name = "cam02";
  view.image.pixels = cv::imread(path, cv::IMREAD_GRAYSCALE);
  view.camera.width_px = view.image.width();
  view.camera.height_px = view.image.height();
  view.camera.intrinsics << 8700, 0, 880, 0, 8700, 880, 0, 0,
      1;  // about 0.158 mm a pixel where the world's origin lies
  view.camera.camera_from_world.translation_mm = {0, 0, 1370};
  const ShaftLines lines = hough_pairs(find_edges(view), view, Options{});
  const auto angle_deg = [](const marrow::LineSegment& s) {
    return marrow::degrees(std::atan2(s.to_px.y() - s.from_px.y(), s.to_px.x() - s.from_px.x()));
  };
  std::printf("knee: width %.1f mm, borders at %.1f and %.1f deg\n", lines.width_mm, angle_deg(lines.left),
              angle_deg(lines.right));
  EXPECT_NEAR(angle_deg(lines.left), 41.5, 4);
  EXPECT_NEAR(angle_deg(lines.right), 42, 4);
  EXPECT_NEAR(lines.left.from_px.x(), 330, 60);  // read off the picture
  EXPECT_NEAR(lines.right.from_px.x(), 190, 60);
}

}  // namespace
