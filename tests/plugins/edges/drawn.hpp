// SPDX-License-Identifier: Apache-2.0
#pragma once
// Images whose edges are known exactly, and the detectors that shall find them.
#include <marrow/domain/camera.hpp>
#include <marrow/domain/features.hpp>
#include <opencv2/core.hpp>
#include <random>
#include <string>
#include <vector>

#include "shipped.hpp"
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

/// The nodes without the kind's name; of edges.gradient_mask, its masks.
const std::vector<std::string> kDetectors{
    "adaptive_relaxation", "canny", "laplacian_of_gaussian", "prewitt", "roberts", "sobel"};

/// The edges that one of kDetectors finds.
inline marrow::EdgeMap found(const std::string& detector, const marrow::View& view,
                             marrow::Context context = marrow::Context()) {
  const bool is_mask = detector == "prewitt" || detector == "roberts" || detector == "sobel";
  const shipped::Options options = is_mask ? shipped::Options{{"mask", detector}} : shipped::Options{};
  return shipped::call("edges." + (is_mask ? "gradient_mask" : detector), {{"view", shipped::item(view)}}, options,
                       std::move(context))
      .at("edges")
      .as<marrow::EdgeMap>();
}

}  // namespace edges
