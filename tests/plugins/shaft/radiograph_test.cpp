// SPDX-License-Identifier: Apache-2.0
// Shafts in radiographs, from edges as edges.adaptive_relaxation finds them.
#include <chrono>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>

#include "tests/plugins/initial/tube.hpp"
#include "tests/plugins/shaft/scenes.hpp"

namespace marrow::test::radiograph_test {

using scenes::Shaft;

EdgeMap find_edges(const View& view) {
  return output<EdgeMap>("edges.adaptive_relaxation", "edges", {{"view", item(view)}});
}

/// Angle and offset of the plane that two borders span against the exact one.
void check_against_truth(const ShaftLines& lines, const View& view, const radiograph::Cylinder& bone) {
  const auto exact = tube::borders(view.camera, bone.point, bone.direction, bone.radius_mm, 100, 400);
  for (const auto& [found, truth] : {std::pair(lines.left, exact.left), std::pair(lines.right, exact.right)}) {
    const Vector2d a = found.to_px - found.from_px, b = truth.to_px - truth.from_px;
    EXPECT_LT(degrees(std::abs(std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)))), 0.15);
  }
  const auto middle = [](const ShaftLines& s, double v) {
    double sum = 0;
    for (const LineSegment* border : {&s.left, &s.right})
      sum += border->from_px.x() + (v - border->from_px.y()) / (border->to_px.y() - border->from_px.y()) *
                                       (border->to_px.x() - border->from_px.x());
    return sum / 2;
  };
  std::printf("  middle off by %.3f and %.3f px, width %.2f of %.2f mm\n", middle(lines, 100) - middle(exact, 100),
              middle(lines, 400) - middle(exact, 400), lines.width_mm, 2 * bone.radius_mm);
  EXPECT_NEAR(middle(lines, 100), middle(exact, 100), 0.3);
  EXPECT_NEAR(middle(lines, 400), middle(exact, 400), 0.3);
}

TEST_P(Shaft, FindsTheShaftOfARadiographAndRejectsCanalAndThigh) {
  for (double photons : {1000.0, 5000.0, 0.0})
    for (double angle : {0.0, 90.0}) {
      const auto scene = radiograph::shaft({5, 3, 0}, {0.08, -0.05, 1});
      const View view =
          radiograph::image(angle == 0 ? "frontal" : "lateral", radiograph::camera(angle), scene, photons, 11);
      const EdgeMap edges = find_edges(view);
      const auto before = std::chrono::steady_clock::now();
      const ShaftLines lines = find_shaft(edges, view);
      std::printf("%.0f photons: %.1f ms\n", photons,
                  std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - before).count());
      EXPECT_NEAR(lines.width_mm, 28, 1.5);
      EXPECT_NEAR(lines.width_deviation_mm, 0.05 * 28, 0.1);  // the depth is not known; the fit is far better
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
        EXPECT_TRUE(said("mm is too small for a shaft (17.2 to 49.9 mm), as a cable's or a single cortex' is"));
      }
    }
}

TEST_P(Shaft, FindsTheShaftOfAThighThatLiesAslant) {
  const auto scene = radiograph::shaft({5, 3, 0}, {0.8, 0.05, 1});
  const View view = radiograph::image("frontal", radiograph::camera(0), scene, 5000, 11);
  check_against_truth(find_shaft(find_edges(view), view), view, scene.cylinders[1]);
}

// A real knee (data of Brown University, see the data folder's README): the distal femur runs from the middle to the
// upper left.
TEST_P(Shaft, FindsTheFemurOfARealKnee) {
  const std::string path = MARROW_SOURCE_DIR "/../shared/data/knee/images/L_Hop_Cam2_001_UND.0138.tif";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "the real knee is not here: " << path;
  View view;
  view.name = "cam02";
  view.image.pixels = cv::imread(path, cv::IMREAD_GRAYSCALE);
  view.camera.width_px = view.image.width();
  view.camera.height_px = view.image.height();
  view.camera.intrinsics << 8700, 0, 880, 0, 8700, 880, 0, 0, 1;  // about 0.158 mm a pixel at 1370 mm
  const ShaftLines lines = find_shaft(find_edges(view), view, {{"source_to_shaft_mm", 1370.0}});
  const auto angle_deg = [](const LineSegment& s) {
    return degrees(std::atan2(s.to_px.y() - s.from_px.y(), s.to_px.x() - s.from_px.x()));
  };
  const auto distance_px = [](const LineSegment& s, const Vector2d& point) {
    const Vector2d along = (s.to_px - s.from_px).normalized();
    return std::abs(along.x() * (point - s.from_px).y() - along.y() * (point - s.from_px).x());
  };
  std::printf("knee: width %.1f +- %.1f mm, borders at %.1f and %.1f deg\n", lines.width_mm, lines.width_deviation_mm,
              angle_deg(lines.left), angle_deg(lines.right));
  EXPECT_NEAR(angle_deg(lines.left), 41.5, 4);
  EXPECT_NEAR(angle_deg(lines.right), 42, 4);
  EXPECT_LT(distance_px(lines.left, {398, 830}), 12);  // points read off the picture
  EXPECT_LT(distance_px(lines.right, {259, 982}), 12);
}

}  // namespace marrow::test::radiograph_test
