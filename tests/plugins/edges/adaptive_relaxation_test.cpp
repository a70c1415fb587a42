// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/adaptive_relaxation.cpp"

#include "tests/plugins/edges/radiograph.hpp"

namespace {

TEST(AdaptiveRelaxation, TakesThresholdsFromPercentilesOfTheWindow) {
  Prepared image;
  image.values = cv::Mat(48, 48, CV_32F, cv::Scalar(0));
  image.usable = cv::Mat(48, 48, CV_8U, cv::Scalar(255));
  Gradient gradient;
  gradient.magnitude.create(48, 48, CV_32F);
  for (int i = 0; i < 48 * 48; ++i) gradient.magnitude.at<float>(i / 48, i % 48) = float(i + 1);
  gradient.du = gradient.dv = cv::Mat(48, 48, CV_32F, cv::Scalar(0));
  Options options;
  options.window_px = 48;
  const Thresholds thresholds = local_thresholds(image, gradient, options);
  EXPECT_NEAR(thresholds.low.at<float>(1, 1), 0.50 * 48 * 48, 10);
  EXPECT_NEAR(thresholds.high.at<float>(1, 1), 0.75 * 48 * 48, 10);
}

TEST(AdaptiveRelaxation, RelabelsOnlySimilarNeighboursOfEdges) {
  cv::Mat labels(5, 9, CV_8U, cv::Scalar(kNone));
  Gradient gradient;
  gradient.du = cv::Mat(5, 9, CV_32F, cv::Scalar(10));
  gradient.dv = cv::Mat(5, 9, CV_32F, cv::Scalar(0));
  gradient.magnitude = cv::Mat(5, 9, CV_32F, cv::Scalar(10));
  labels.at<uchar>(2, 1) = kEdge;
  for (int u = 2; u < 8; ++u) labels.at<uchar>(2, u) = kIntermediate;
  gradient.du.at<float>(2, 4) = gradient.magnitude.at<float>(2, 4) = 6;  // 40 % weaker: passes 0.5
  gradient.du.at<float>(2, 6) = 0, gradient.dv.at<float>(2, 6) = 10;     // turned by 90 degrees: stops the growth
  relax(gradient, Options{}, labels);
  EXPECT_EQ(labels.at<uchar>(2, 5), kEdge);
  EXPECT_EQ(labels.at<uchar>(2, 6), kIntermediate);
  EXPECT_EQ(labels.at<uchar>(2, 7), kIntermediate);
  gradient.du.at<float>(2, 4) = gradient.magnitude.at<float>(2, 4) = 4;  // 60 % weaker: does not
  labels.at<uchar>(2, 4) = labels.at<uchar>(2, 5) = kIntermediate;
  relax(gradient, Options{}, labels);
  EXPECT_EQ(labels.at<uchar>(2, 3), kEdge);
  EXPECT_EQ(labels.at<uchar>(2, 5), kIntermediate);
}

TEST(AdaptiveRelaxation, RemovesSmallComponents) {
  cv::Mat labels(6, 10, CV_8U, cv::Scalar(kNone));
  for (int i = 1; i < 5; ++i) labels.at<uchar>(i, i) = kEdge;  // four in a diagonal
  labels.at<uchar>(1, 7) = labels.at<uchar>(2, 7) = kEdge;     // two
  const cv::Mat kept = large_components(labels, 3);
  EXPECT_EQ(cv::countNonZero(kept), 4);
  EXPECT_EQ(kept.at<uchar>(1, 7), 0);
}

TEST(AdaptiveRelaxation, DeclaresTheOrderOfItsThresholds) {
  EXPECT_TRUE(shipped::declares("edges.adaptive_relaxation", marrow::not_above("low", "high")));
}

TEST(AdaptiveRelaxation, KeepsThickEdgesOnRequest) {
  const auto view = edges::drawn(64, [](double u, double) { return u < 30 ? 5000.0 : 9000.0; });
  Options options;
  options.thin = false;
  marrow::Context context;
  EXPECT_GE(adaptive_relaxation(view, options, context).pixels.size(),
            adaptive_relaxation(view, Options{}, context).pixels.size());
}

}  // namespace
