// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/image/grey_range.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/image/line_integrals.hpp"
#include "tests/plugins/edges/drawn.hpp"

namespace marrow::test::grey_range_test {

using image::grey_range;
using image::GreyScale;

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

struct Found {
  Found(const std::string& detector, const View& view) {
    marrow::Context::Hooks hooks;
    hooks.log = [this](std::string_view text, marrow::LogLevel) { lines.emplace_back(text); };
    edges = edges::found(detector, view, marrow::Context(hooks));
  }
  Strings lines;
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
    EXPECT_NE(
        found.lines[0].find("pixels are negative, down to -2000, which is taken as the grey value where no light "
                            "falls; edges may be off by a fraction of a pixel, so give the detector's own grey values"),
        std::string::npos)
        << found.lines[0];
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

}  // namespace marrow::test::grey_range_test
