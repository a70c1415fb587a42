// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a picture shows: colours of pixels, and texts. A text is compared with the same text drawn by the test.

#include "marrow/toolbox/draw/canvas.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::pictures {

/// Whether a pixel has about this colour.
inline bool has(const cv::Mat& picture, cv::Point pixel, const cv::Scalar& colour) {
  const auto value = picture.at<cv::Vec3b>(pixel);
  return std::abs(value[0] - colour[0]) < 40 && std::abs(value[1] - colour[1]) < 40 &&
         std::abs(value[2] - colour[2]) < 40;
}

inline bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && a.type() == b.type() && cv::norm(a, b, cv::NORM_INF) == 0;
}

/// Whether the picture has this legend, and nothing else, below its first `height` rows.
inline bool has_legend(const cv::Mat& picture, int height, const std::vector<draw::LegendItem>& items) {
  const cv::Mat expected = draw::with_legend(cv::Mat(height, picture.cols, CV_8UC3, cv::Scalar()), items);
  return same(expected.rowRange(height, expected.rows), picture.rowRange(height, picture.rows));
}

}  // namespace marrow::test::pictures
