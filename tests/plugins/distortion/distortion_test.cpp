// SPDX-License-Identifier: Apache-2.0
// What a measured distortion does to points, images and masks, and between poses of the arm: hand-computed values.

#include <opencv2/imgproc.hpp>

#include "marrow/domain/random.hpp"
#include "marrow/toolbox/distortion/fit.hpp"
#include "tests/plugins/read/files.hpp"

namespace distortion_test {

using namespace marrow;
using namespace marrow::test;
using Eigen::Vector2d;
using namespace distortion;

/// A field of 101 x 81 pixels, measured everywhere. Half its longer side is 50.5 px, its middle (50, 40).
Distortion everywhere(int degree, std::vector<Vector2d> terms) {
  Distortion d;
  d.width_px = 101;
  d.height_px = 81;
  d.degree = degree;
  d.terms_px = std::move(terms);
  d.area_px = {{-1, -1}, {101, -1}, {101, 81}, {-1, 81}};
  return d;
}

/// Shift (2, -1), and u is moved by 3 x y, v by -4 y^2 + x^3.
Distortion example() {
  std::vector<Vector2d> terms(terms_of(3), Vector2d::Zero());
  terms[0] = {2, -1};
  terms[4] = {3, 0};
  terms[5] = {0, -4};
  terms[6] = {0, 1};
  return everywhere(3, terms);
}

TEST(Distortion, MovesAPixelByItsTerms) {
  const Vector2d ideal(50 + 0.5 * 50.5, 40 - 0.2 * 50.5);
  const Vector2d seen = seen_pixel(example(), ideal);
  EXPECT_NEAR(seen.x() - ideal.x(), 2 + 3 * 0.5 * -0.2, 1e-12);
  EXPECT_NEAR(seen.y() - ideal.y(), -1 - 4 * 0.04 + 0.125, 1e-12);
  const auto back = ideal_pixel(example(), seen);
  ASSERT_TRUE(back);
  EXPECT_LT((*back - ideal).norm(), 1e-8);
}

TEST(Distortion, ALatticeMeetsItsNodesAndIsExactForParabolas) {
  Distortion d = everywhere(0, {{0, 0}});
  d.step_px = 10;
  for (int row = 0; row < lattice_rows(d); ++row)
    for (int column = 0; column < lattice_columns(d); ++column)
      d.lattice_px.emplace_back(0.02 * column * column, 0.03 * row * column);
  EXPECT_EQ(d.lattice_px.size(), 11u * 9u);
  EXPECT_LT((seen_pixel(d, {30, 20}) - Vector2d(30 + 0.18, 20 + 0.18)).norm(), 1e-12);
  EXPECT_LT((seen_pixel(d, {45, 32}) - Vector2d(45 + 0.02 * 4.5 * 4.5, 32 + 0.03 * 3.2 * 4.5)).norm(), 1e-12);
}

TEST(Distortion, OutsideOfTheAreaNothingIsMeasured) {
  Distortion d = example();
  d.area_px = {{10, 10}, {60, 10}, {10, 60}};
  EXPECT_TRUE(is_measured(d, {20, 20}));
  EXPECT_FALSE(is_measured(d, {50, 50}));
  EXPECT_FALSE(ideal_pixel(d, seen_pixel(d, {50, 50})));
}

TEST(Distortion, SaysWhatIsWrongWithIt) {
  Distortion d = example();
  d.terms_px.pop_back();
  EXPECT_SAYS(check_distortion(d, "c.yaml"), "c.yaml: there are 9 terms, but a polynomial of degree 3 has 10");
  d = example();
  d.area_px.resize(2);
  EXPECT_SAYS(check_distortion(d, "c.yaml"), "c.yaml: the measured area has 2 corners; at least 3 are needed");
  d = example();
  d.terms_px[1] = {std::nan(""), 0};
  EXPECT_SAYS(check_distortion(d, "c.yaml"), "a number is not finite");
  d = everywhere(1, {{0, 0}, {-60, 0}, {0, 0}});
  EXPECT_SAYS(check_distortion(d, "c.yaml"), "the distortion folds the image");
  d = example();
  d.step_px = 10;
  d.lattice_px.resize(5, Vector2d::Zero());
  EXPECT_SAYS(check_distortion(d, "c.yaml"), "the lattice has 5 nodes, but one with a step of 10 px has 99");
}

/// A view whose grey values are those of `pattern` at each pixel's ideal place.
View bent_view(const Distortion& d, double (*pattern)(const Vector2d&)) {
  View view{"v", {cv::Mat1f(d.height_px, d.width_px, 0.f)}, {}, {}};
  view.camera.width_px = d.width_px;
  view.camera.height_px = d.height_px;
  view.camera.intrinsics << 500, 0, 50, 0, 500, 40, 0, 0, 1;
  for (int v = 0; v < d.height_px; ++v)
    for (int u = 0; u < d.width_px; ++u)
      if (const auto ideal = ideal_pixel(d, {u, v})) view.image.pixels.at<float>(v, u) = float(pattern(*ideal));
  return view;
}

TEST(Distortion, AStraightenedImageShowsThePattern) {
  const auto pattern = [](const Vector2d& at) { return 100 + 30 * std::sin(at.x() / 9) + 20 * std::cos(at.y() / 7); };
  Distortion d = example();
  View view = bent_view(d, pattern);
  straighten(view, d);
  for (int v = 10; v < 70; ++v)
    for (int u = 10; u < 90; ++u)
      ASSERT_NEAR(view.image.pixels.at<float>(v, u), pattern({u, v}), 0.3) << u << ", " << v;
  EXPECT_EQ(view.mask.at<std::uint8_t>(0, 50), 0);  // it was seen 1 px above the image
  EXPECT_EQ(view.mask.at<std::uint8_t>(40, 50), 255);
  EXPECT_EQ(view.camera.intrinsics(0, 0), 500);
}

TEST(Distortion, MasksAreCarriedToTheStraightImageAndBack) {
  Distortion d = example();
  d.area_px = {{5, 5}, {95, 5}, {95, 75}, {5, 75}};
  View view = bent_view(d, [](const Vector2d&) { return 7.0; });
  view.mask = cv::Mat1b(81, 101, std::uint8_t(255));
  const Vector2d seen = seen_pixel(d, {30, 40});
  cv::rectangle(view.mask, cv::Rect(int(seen.x()) - 2, int(seen.y()) - 2, 5, 5), cv::Scalar(0), cv::FILLED);
  straighten(view, d);
  EXPECT_EQ(view.mask.at<std::uint8_t>(40, 30), 0);
  EXPECT_EQ(view.mask.at<std::uint8_t>(40, 60), 255);
  EXPECT_EQ(view.mask.at<std::uint8_t>(2, 50), 0) << "not measured there";
  cv::Mat1b drawn(81, 101, std::uint8_t(255));
  cv::rectangle(drawn, cv::Rect(40, 30, 9, 7), cv::Scalar(0), cv::FILLED);
  const cv::Mat1b again = straightened_mask(original_mask(drawn, d), d);
  for (int v = 6; v < 74; ++v)
    for (int u = 6; u < 94; ++u) {
      const bool is_far = u < 38 || u > 50 || v < 28 || v > 38;
      if (drawn(v, u) == 0 || is_far) {
        EXPECT_EQ(again(v, u), drawn(v, u)) << u << ", " << v;
      }
    }
}

TEST(Distortion, AViewOfAnotherSizeIsRefused) {
  View view = bent_view(example(), [](const Vector2d&) { return 1.0; });
  Distortion d = example();
  d.width_px = 102;
  EXPECT_SAYS(straighten(view, d),
              "view 'v': the image has 101 x 81 pixels, but the distortion is of images of 102 x 81");
}

/// Points on a lattice, bent by `d`.
PlatePoints points_of(const Distortion& d, int step) {
  PlatePoints points;
  points.width_px = d.width_px;
  points.height_px = d.height_px;
  for (int v = 2; v < d.height_px - 2; v += step)
    for (int u = 2; u < d.width_px - 2; u += step) points.add(Vector2d(u, v), seen_pixel(d, {u, v}));
  return points;
}

TEST(FitDistortion, FindsItsOwnPolynomialAndTheWrongPoint) {
  PlatePoints points = points_of(example(), 5);
  points.seen_px[70] += Vector2d(4, 3);
  const Fit fit = fit_distortion(points, {});
  EXPECT_EQ(fit.distortion.degree, 3);
  EXPECT_LT(fit.distortion.validated_px, 1e-9);
  EXPECT_EQ(fit.points.used[70], 0);
  EXPECT_EQ(std::count(fit.points.used.begin(), fit.points.used.end(), 0), 1);
  for (std::size_t i = 0; i < terms_of(3); ++i)
    EXPECT_LT((fit.distortion.terms_px[i] - example().terms_px[i]).norm(), 1e-9) << i;
}

TEST(FitDistortion, TheValidatedResidualSeesTooManyTerms) {
  PlatePoints points = points_of(example(), 9);  // 99 points
  Random random(3);
  for (Vector2d& seen : points.seen_px) seen += 0.2 * Vector2d(random.normal(), random.normal());
  FitOptions options;
  options.model = Model::polynomial;
  options.lowest_degree = options.highest_degree = 6;
  const Fit many = fit_distortion(points, options);
  EXPECT_GT(many.distortion.validated_px, 1.3 * many.distortion.residual_px);
  options.lowest_degree = 3;
  EXPECT_EQ(fit_distortion(points, options).distortion.degree, 3);
}

TEST(FitDistortion, ALocalModelFollowsABumpThatNoPolynomialFollows) {
  PlatePoints points = points_of(example(), 3);
  const auto bump = [](const Vector2d& at) {
    return Vector2d(2 * std::exp(-(at - Vector2d(30, 30)).squaredNorm() / 60), 0);
  };
  for (std::size_t i = 0; i < points.used.size(); ++i) points.seen_px[i] += bump(points.ideal_px[i]);
  FitOptions options;
  options.outlier_deviations = 100;
  options.model = Model::polynomial;
  const double without = fit_distortion(points, options).distortion.validated_px;
  options.model = Model::automatic;
  const Fit fit = fit_distortion(points, options);
  EXPECT_TRUE(fit.is_local);
  EXPECT_LT(fit.distortion.validated_px, 0.5 * without);
}

TEST(FitDistortion, TooFewPointsAreSaid) {
  PlatePoints points = points_of(example(), 20);
  EXPECT_SAYS(fit_distortion(points, {}), "20 points are known, but a polynomial of degree 3 needs at least 30");
}

TEST(ShapeOf, FindsTurnAndPincushion) {
  // Displacement c r^2 (x, y) moves outwards, c r^2 (-y, x) turns clockwise; half the side is 50.5 px.
  std::vector<Vector2d> terms(terms_of(3), Vector2d::Zero());
  const double out = 1.5, turn = 0.4;
  terms[6] = {out, turn};
  terms[7] = {-turn, out};
  terms[8] = {out, turn};
  terms[9] = {-turn, out};
  const Distortion d = everywhere(3, terms);
  const PlatePoints points = points_of(d, 3);
  const Shape shape = shape_of(d, points);
  const double s = shape.rim_px / 50.5;
  EXPECT_NEAR(shape.pincushion_px, out * s * s * s, 0.02);
  EXPECT_NEAR(shape.turn_deg, degrees(turn * s * s / 50.5), 0.02);
}

ArmPose at(double first) { return ArmPose::Constant(1, first); }
ArmPose at(double first, double second) { return Vector2d(first, second); }

TEST(SharesAt, InterpolateAndSumToOne) {
  const Eigen::VectorXd two = shares_at({at(0), at(40)}, at(10));
  EXPECT_NEAR(two[0], 0.75, 1e-9);
  EXPECT_NEAR(two[1], 0.25, 1e-9);
  const std::vector<ArmPose> four{at(-30), at(0), at(25), at(60)};
  EXPECT_LT((shares_at(four, at(25)) - Eigen::VectorXd::Unit(4, 2)).norm(), 1e-9);
  EXPECT_NEAR(shares_at({at(12)}, at(50))[0], 1, 1e-12);
  const Eigen::VectorXd plane = shares_at({at(0, 0), at(30, 0), at(0, 30), at(30, 30)}, at(10, 20));
  EXPECT_NEAR(plane.sum(), 1, 1e-9);
  // Exact for what is linear in the angles.
  EXPECT_NEAR(plane[1] * 30 + plane[3] * 30, 10, 1e-9);
  EXPECT_NEAR(plane[2] * 30 + plane[3] * 30, 20, 1e-9);
  // Poses on one line do not determine a trend across it.
  EXPECT_NEAR(shares_at({at(0, 0), at(30, 0)}, at(15, 7)).sum(), 1, 1e-9);
}

TEST(SharesAt, FollowASineBetweenPoses30DegreesApart) {
  const std::vector<double> angles{-90, -60, -30, 0, 30, 60, 90};
  std::vector<ArmPose> measured;
  for (const double angle : angles) measured.push_back(at(angle));
  for (double angle = -75; angle <= 75; angle += 10) {
    const Eigen::VectorXd shares = shares_at(measured, at(angle));
    double sum = 0;
    for (std::size_t i = 0; i < angles.size(); ++i) sum += shares[Eigen::Index(i)] * std::cos(radians(angles[i]));
    EXPECT_NEAR(sum, std::cos(radians(angle)), 0.015) << angle;
  }
}

TEST(IsBetween, KnowsWhatWasMeasured) {
  EXPECT_TRUE(is_between({at(-30), at(60)}, at(60)));
  EXPECT_FALSE(is_between({at(-30), at(60)}, at(60.5)));
  EXPECT_TRUE(is_between({at(0, 0), at(30, 0), at(0, 30)}, at(10, 10)));
  EXPECT_FALSE(is_between({at(0, 0), at(30, 0), at(0, 30)}, at(20, 20)));
}

TEST(Mixed, AddsTermsOfDifferentDegreesAndKeepsTheCommonArea) {
  Distortion low = everywhere(1, {{1, 0}, {2, 0}, {0, 4}}), high = example();
  low.area_px = {{0, 0}, {60, 0}, {60, 80}, {0, 80}};
  List<Distortion> both;
  both.add("a", low);
  both.add("b", high);
  const Distortion half = mixed(both, Vector2d(0.5, 0.5));
  const Vector2d pixel(30, 30);
  EXPECT_LT((seen_pixel(half, pixel) - 0.5 * (seen_pixel(low, pixel) + seen_pixel(high, pixel))).norm(), 1e-12);
  EXPECT_TRUE(is_measured(half, {59, 40}));
  EXPECT_FALSE(is_measured(half, {61, 40}));
}

TEST(Mixed, RefusesWhatIsNotOfOneArm) {
  List<Distortion> sizes;
  sizes.add("a", example());
  Distortion other = example();
  other.width_px = 120;
  sizes.add("b", other);
  EXPECT_SAYS(mixed(sizes, Vector2d(0.5, 0.5)), "the distortion 'a' is of images of 101 x 81 pixels, 'b' of 120 x 81");
  List<Distortion> apart;
  Distortion left = example(), right = example();
  left.area_px = {{0, 0}, {20, 0}, {20, 80}, {0, 80}};
  right.area_px = {{60, 0}, {90, 0}, {90, 80}, {60, 80}};
  apart.add("a", left);
  apart.add("b", right);
  EXPECT_SAYS(mixed(apart, Vector2d(0.5, 0.5)), "no part of the image was measured at all poses of the arm");
}

}  // namespace distortion_test
