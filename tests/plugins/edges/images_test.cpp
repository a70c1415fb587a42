// SPDX-License-Identifier: Apache-2.0
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/similarity/blur.hpp"
#include "marrow/toolbox/image/field_of_view.hpp"
#include "marrow/toolbox/image/grey_values.hpp"
#include "tests/plugins/edges/radiograph.hpp"

namespace marrow::test::images_test {

using image::grey_range, image::GreyScale, image::line_integrals;
using namespace image;

TEST(LineIntegrals, AreLogarithmsOfWhatIsLeft) {
  const cv::Mat grey = (cv::Mat_<std::uint16_t>(1, 5) << 1000, 500, 5, 4, 0);
  const cv::Mat values = line_integrals(grey);
  ASSERT_EQ(values.type(), CV_32FC1);
  EXPECT_EQ(values.at<float>(0), 0);
  EXPECT_FLOAT_EQ(values.at<float>(1), std::log(2.0f));
  for (int dark = 2; dark < 5; ++dark)
    EXPECT_FLOAT_EQ(values.at<float>(dark), std::log(200.0f)) << "at most that of a two-hundredth of the brightest";
}

TEST(LineIntegrals, OfEachType) {
  const cv::Mat bytes = (cv::Mat_<std::uint8_t>(1, 2) << 200, 50);
  EXPECT_FLOAT_EQ(line_integrals(bytes).at<float>(1), std::log(4.0f));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const cv::Mat real = (cv::Mat_<float>(1, 4) << 0.5f, 0.25f, -0.001f, nan);
  const cv::Mat values = line_integrals(real);
  EXPECT_FLOAT_EQ(values.at<float>(1), std::log(2.0f));
  EXPECT_FLOAT_EQ(values.at<float>(2), std::log(200.0f));
  EXPECT_TRUE(std::isnan(values.at<float>(3)));
}

TEST(LineIntegrals, OfOneValueAreThoseOfTheImage) {
  const cv::Mat grey = (cv::Mat_<float>(1, 4) << 7.0f, 3.0f, 0.001f, -0.02f);
  const GreyScale scale(grey);
  EXPECT_EQ(scale.air(), 7);
  EXPECT_EQ(scale.dark(), 0);
  const cv::Mat values = line_integrals(grey);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(scale.line_integral(double(grey.at<float>(i))), double(values.at<float>(i)), 1e-6) << i;
  EXPECT_TRUE(std::isnan(scale.line_integral(std::numeric_limits<double>::quiet_NaN())));
}

TEST(LineIntegrals, WithoutLightAreThoseOfDarkPixels) {
  const cv::Mat black(2, 2, CV_16U, cv::Scalar(0)), negative(2, 2, CV_32F, cv::Scalar(-3));
  for (const cv::Mat& image : {black, negative}) {
    const cv::Mat values = line_integrals(image);
    for (int i = 0; i < 4; ++i) EXPECT_FLOAT_EQ(values.at<float>(i / 2, i % 2), std::log(200.0f));
  }
}

/// A disc of 40 pixels radius with a line integral of 1.2 before air of 4000, in the shadow of a plate that lets
/// nothing through. Its edges are blurred a little, so that the logarithm matters.
View disc(double noise = 20) {
  const auto step = [](double outside) { return 1 / (1 + std::exp(-2 * outside)); };
  return edges::drawn(
      200,
      [&](double u, double v) {
        const double integral = 1.2 * (1 - step(std::hypot(u - 100, v - 110) - 40));
        return 4000 * std::exp(-integral) * step(v - 30);
      },
      noise);
}

struct Found : Heard {
  Found(const std::string& detector, const View& view) : edges(edges::found(detector, view, context)) {}
  EdgeMap edges;
};

/// The largest distance of an edge of `a`, off the pixel (20, 180), from the nearest one of `b`.
double farthest_px(const EdgeMap& a, const EdgeMap& b) {
  double farthest = 0;
  for (const EdgePixel& p : a.pixels) {
    if (std::hypot(p.u_px - 20, p.v_px - 180) < 15) continue;
    double nearest = INFINITY;
    for (const EdgePixel& q : b.pixels)
      nearest = std::min(nearest, double(std::hypot(p.u_px - q.u_px, p.v_px - q.v_px)));
    farthest = std::max(farthest, nearest);
  }
  return farthest;
}

TEST(GreyRange, OnePixelDoesNotDecideTheScale) {
  View view = disc();
  const double air = grey_range(view.image.pixels).greatest;
  EXPECT_EQ(grey_range(view.image.pixels).beyond, 0u);
  view.image.pixels.at<std::uint16_t>(180, 20) = 65535;
  const image::GreyRange range = grey_range(view.image.pixels);
  EXPECT_EQ(range.greatest, air);
  EXPECT_EQ(range.beyond, 1u);
  EXPECT_EQ(range.farthest, 65535);
  // Beer and Lambert: exp(-0.05) of the light is left.
  EXPECT_NEAR(GreyScale(view.image.pixels).line_integral(air * std::exp(-0.05)), 0.05, 1e-9);
  EXPECT_EQ(GreyScale(view.image.pixels).line_integral(65535), 0) << "what is brighter than air counts as air";
  cv::Mat floats;
  view.image.pixels.convertTo(floats, CV_32F);
  floats.at<float>(3, 3) = -1e6f, floats.at<float>(4, 4) = std::numeric_limits<float>::infinity();
  EXPECT_EQ(grey_range(floats).greatest, air);
  EXPECT_EQ(grey_range(floats).least, 0);
  EXPECT_EQ(grey_range(floats).beyond, 2u) << "infinity is not counted";
}

TEST(GreyRange, WhatTheImageShowsIsNeverBeyond) {
  // A quarter of the image is twice as bright; noise of 10 %; a field of air of 5 x 5 pixels; a line alone.
  const View bright = edges::drawn(
      200, [](double u, double v) { return u < 100 && v < 100 ? 8000 : 4000; }, 400);
  EXPECT_EQ(grey_range(bright.image.pixels).beyond, 0u);
  View field = disc();
  field.image.pixels(cv::Rect(150, 150, 5, 5)).setTo(65535);
  EXPECT_EQ(grey_range(field.image.pixels).greatest, 65535);
  cv::Mat line = cv::Mat::zeros(200, 200, CV_8U);
  line.row(100).setTo(255);
  EXPECT_EQ(grey_range(line).greatest, 255);
}

TEST(GreyRange, EdgesAreTheSameWithABadPixel) {
  const View clean = disc();
  View bad = clean;
  bad.image.pixels = clean.image.pixels.clone();
  bad.image.pixels.at<std::uint16_t>(180, 20) = 65535;
  for (const std::string& node : edges::kDetectors) {
    const Found right(node, clean), found(node, bad);
    EXPECT_TRUE(right.lines.empty()) << node;
    ASSERT_EQ(found.lines.size(), 1u) << node;
    EXPECT_EQ(found.lines[0],
              "view 'frontal': 1 of 40000 pixels is far beyond all others (65535, the others reach from 0 to " +
                  formatted("{:g}", grey_range(clean.image.pixels).greatest) +
                  "), as defects of a detector and letters are; it counts as the nearest of the others");
    EXPECT_LT(farthest_px(right.edges, found.edges), 0.02) << node;
    EXPECT_LT(farthest_px(found.edges, right.edges), 0.02) << node;
  }
}

TEST(GreyRange, AnOffsetDoesNotMoveEdges) {
  // The image has a place where no light falls, so the offset is known.
  const View clean = disc(0);
  View shifted = clean;
  clean.image.pixels.convertTo(shifted.image.pixels, CV_32F, 1, -2000);
  View true_floats = clean;
  clean.image.pixels.convertTo(true_floats.image.pixels, CV_32F);
  for (const std::string& node : edges::kDetectors) {
    const Found right(node, true_floats), found(node, shifted);
    EXPECT_TRUE(right.lines.empty()) << node;
    ASSERT_EQ(found.lines.size(), 1u) << node;
    EXPECT_HAS(found.lines[0],
               "pixels are negative, down to -2000, which is taken as the grey value where no light "
               "falls; edges may be off by a fraction of a pixel, so give the detector's own grey values");
    EXPECT_LT(farthest_px(right.edges, found.edges), 0.02) << node;
  }
}

TEST(GreyRange, NoiseAboutZeroIsNoOffset) {
  View view = disc();
  cv::Mat floats;
  view.image.pixels.convertTo(floats, CV_32F, 1, -10);  // half a percent of air is 20
  EXPECT_EQ(grey_range(floats).dark(), 0);
  EXPECT_EQ(GreyScale(floats).dark(), 0);
}

/// A limb with a bone across a round field of the given radius; beyond the field is scatter, and the outline is
/// blurred.
cv::Mat collimated(double radius, double scatter, bool limb = true) {
  cv::Mat grey(400, 480, CV_32F);
  std::mt19937 random(4);
  std::normal_distribution<float> noise(0, 1);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double across = std::abs(u + 0.3 * v - 300);
      double value = 50000;
      if (limb) value *= across < 30 ? 0.15 : across < 120 ? 0.3 : 1.0;
      const double inside = 1 / (1 + std::exp(std::hypot(u - 243.4, v - 196.2) - radius));
      value = 200 + value * inside + scatter * (1 - inside) * (1 + std::sin(0.05 * u) * std::sin(0.04 * v));
      grey.at<float>(v, u) = float(value) + float(std::sqrt(value)) * noise(random);
    }
  return grey;
}

std::optional<Field> field_of(const cv::Mat& grey) {
  double largest = 0;
  cv::minMaxLoc(grey, nullptr, &largest);
  return collimator_field(grey, largest);
}

void expect_outline(const cv::Mat& grey, double radius) {
  const auto field = field_of(grey);
  ASSERT_TRUE(field);
  double worst = 0;
  for (int i = 0; i < 360; ++i) {
    const double angle = 2 * kPi * i / 360, r = field->radius(angle);
    const cv::Point2d at = field->centre + r * cv::Point2d(std::cos(angle), std::sin(angle));
    if (at.x < 0 || at.y < 0 || at.x > grey.cols - 1 || at.y > grey.rows - 1) continue;
    worst = std::max(worst, std::abs(std::hypot(at.x - 243.4, at.y - 196.2) - radius));
  }
  std::printf("radius %.0f: outline within %.2f px\n", radius, worst);
  EXPECT_LT(worst, 1.5);
}

TEST(Usable, FindsTheFieldOfARoundCollimator) {
  expect_outline(collimated(170, 0), 170);
  expect_outline(collimated(170, 1500), 170);
  expect_outline(collimated(170, 4000, false), 170);
}

TEST(Usable, FindsAFieldOfWhichTheImageHoldsArcsOnly) { expect_outline(collimated(230, 1000), 230); }

TEST(Usable, TakesNoLimbOrBrightCornerForACollimator) {
  EXPECT_FALSE(field_of(collimated(1000, 0)));
  cv::Mat grey = collimated(1000, 0, false);
  cv::circle(grey, {240, 200}, 120, 3000.0f, -1);  // dark inside, not outside
  EXPECT_FALSE(field_of(grey));
  grey = cv::Mat(400, 480, CV_32F, cv::Scalar(2000));  // dark corners and a bright square
  grey(cv::Rect(100, 80, 250, 220)) = 50000;
  EXPECT_FALSE(field_of(grey));
}

TEST(Usable, TakesNoArcInTheLitFieldOfARectangularCollimatorForOne) {
  cv::Mat grey(400, 480, CV_32F, cv::Scalar(8000));
  for (int v = 20; v < 380; ++v)
    for (int u = 20; u < 460; ++u)
      grey.at<float>(v, u) = std::hypot(u - 243.4, v - 236.2) < 160 ? 50000.0f : 15000.0f;  // a thick limb, say
  EXPECT_FALSE(field_of(grey));
}

TEST(Usable, LeavesAMarginEverywhere) {
  View view;
  const cv::Mat grey = collimated(170, 1500);
  double smallest = 0, largest = 0;
  cv::minMaxLoc(grey, &smallest, &largest);
  const cv::Mat usable = usable_pixels(view, grey, smallest, largest, 5);
  for (int v = 0; v < grey.rows; ++v)
    for (int u = 0; u < grey.cols; ++u) {
      const double inside = 170 - std::hypot(u - 243.4, v - 196.2);
      if (inside < 7) {
        ASSERT_EQ(usable.at<uchar>(v, u), 0) << u << " " << v;
      } else if (inside > 11) {
        ASSERT_NE(usable.at<uchar>(v, u), 0) << u << " " << v;
      }
    }
}

// Real frames of a knee (Brown University, see the data folder's README); their outlines were read off the pictures.
TEST(Usable, FindsTheFieldOfRealFrames) {
  const std::string folder = MARROW_SOURCE_DIR "/../shared/data/knee/images/";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "the real knee is not here: " << folder;
  for (const auto& [name, right, other] :
       {std::tuple<std::string, double, double>{"L_Hop_Cam1_001_UND.0138.tif", 1736, 1752},
        {"L_Hop_Cam2_001_UND.0138.tif", 1750, 13}}) {
    cv::Mat grey;
    cv::imread(folder + name, cv::IMREAD_GRAYSCALE).convertTo(grey, CV_32F);
    const auto field = field_of(grey);
    ASSERT_TRUE(field) << name;
    const double down = other > 880 ? 1 : -1;
    const double at_right = field->centre.x + field->radius(0),
                 at_other = field->centre.y + down * field->radius(down * kPi / 2);
    std::printf("%s: radius %.1f about %.1f, %.1f; right end at %.1f, %s at %.1f\n", name.c_str(), field->harmonics[0],
                field->centre.x, field->centre.y, at_right, down > 0 ? "lower" : "upper", at_other);
    EXPECT_NEAR(at_right, right, 4);
    EXPECT_NEAR(at_other, other, 4);
  }
}

constexpr int kSize_px = 240;

/// exp(-line integral) in 16 bits, with noise of this standard deviation in grey values.
template <class LineIntegral>
cv::Mat image_of(const LineIntegral& line_integral, double noise) {
  cv::Mat image(kSize_px, kSize_px, CV_16U);
  std::mt19937 random(3);
  std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
  for (int v = 0; v < kSize_px; ++v)
    for (int u = 0; u < kSize_px; ++u)
      image.at<std::uint16_t>(v, u) = std::uint16_t(
          std::clamp(60000 * std::exp(-line_integral(u, v)) + (noise > 0 ? normal(random) : 0.0), 0.0, 65535.0));
  return image;
}

/// Edges along a line through the middle of the image, whose bright side is at `angle`.
EdgeMap edges_at(double angle, double inside_px = 0) {
  EdgeMap edges{kSize_px, kSize_px, {}};
  const double du = std::cos(angle), dv = std::sin(angle);
  for (int along = -80; along <= 80; ++along)
    edges.pixels.push_back(
        {float(120 - inside_px * du - along * dv), float(120 - inside_px * dv + along * du), float(du), float(dv), 1});
  return edges;
}

TEST(Blur, OfAStep) {
  for (const double sigma : {1.0, 2.0, 4.0})
    for (const double angle : {0.0, 0.4, 2.0})
      for (const double noise : {0.0, 300.0}) {
        const cv::Mat image = image_of(
            [&](int u, int v) {
              const double way = (u - 120) * std::cos(angle) + (v - 120) * std::sin(angle);
              return 0.2 + 0.4 * std::erfc(way / (sigma * std::sqrt(2.0)));
            },
            noise);
        EXPECT_NEAR(image::blur_px(image, edges_at(angle)), sigma, noise > 0 ? 0.15 * sigma : 0.08)
            << sigma << " px at " << angle << " with noise " << noise;
      }
}

TEST(Blur, ARoundBonesBorderIsSteepestInsideItsSilhouette) {
  // The path grows with the square root of the distance s = q^2 inside the silhouette. So its slope, blurred by a
  // Gaussian of 1 px, is the integral of exp(-(x - q^2)^2 / 2) over q, up to a factor.
  double steepest = 0, at = 0;
  for (double x = 0; x < 2; x += 0.005) {
    double slope = 0;
    for (double q = 0; q < 4; q += 0.001) slope += std::exp(-0.5 * (x - q * q) * (x - q * q));
    if (slope > steepest) steepest = slope, at = x;
  }
  EXPECT_NEAR(at, image::border_inside_px(1), 0.01);
  EXPECT_EQ(image::border_inside_px(3), 3 * image::border_inside_px(1));
}

TEST(Blur, OfTooFewEdgesIsNone) {
  EdgeMap few = edges_at(0);
  few.pixels.resize(19);
  const cv::Mat image = image_of([](int u, int) { return u < 120 ? 1.0 : 0.2; }, 0);
  EXPECT_EQ(image::blur_px(image, few), 0);
  EXPECT_EQ(image::blur_px(image, {}), 0);
  EXPECT_EQ(image::blur_px({}, edges_at(0)), 0);
}

}  // namespace marrow::test::images_test
