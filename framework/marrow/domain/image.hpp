// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <opencv2/core.hpp>
#include <string>

#include "marrow/base/export.hpp"
#include "marrow/base/fields.hpp"

namespace MARROW_EXPORT marrow {

/// A fluoroscopic image with one channel of type CV_8U, CV_16U or CV_32F. Air is bright unless a node says otherwise.
/// Pixel (0, 0) is at the top left, and integer coordinates are pixel centres (OpenCV's convention). Never write to the
/// pixels of an Image that you were given: copies of a cv::Mat share them.
struct Image {
  cv::Mat pixels;

  int width() const { return pixels.cols; }
  int height() const { return pixels.rows; }

  using fields = Fields<&Image::pixels>;
};

/// A picture for people: CV_8UC3 in RGB order.
struct Picture {
  cv::Mat pixels;
  using fields = Fields<&Picture::pixels>;
};

}  // namespace marrow
