// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images whose edges are known exactly.
#include <marrow/domain/camera.hpp>
#include <opencv2/core.hpp>
#include <random>

#include "tests/plugins/edges/radiograph.hpp"

namespace edges {

/// A view of an image whose brightness at a point is function(u, v); each pixel is the mean over 8 x 8 points.
template <class Function>
marrow::View drawn(int size, Function function, double noise = 0, unsigned seed = 1) {
  marrow::View view;
  view.name = "frontal";
  view.camera = radiograph::camera(0, size);
  view.image.pixels.create(size, size, CV_16U);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal(0, noise > 0 ? noise : 1);
  for (int v = 0; v < size; ++v)
    for (int u = 0; u < size; ++u) {
      double sum = 0;
      for (int k = 0; k < 64; ++k) sum += function(u + (k % 8 - 3.5) / 8, v + (k / 8 - 3.5) / 8);
      view.image.pixels.at<std::uint16_t>(v, u) =
          cv::saturate_cast<std::uint16_t>(sum / 64 + (noise > 0 ? normal(random) : 0));
    }
  return view;
}

}  // namespace edges
