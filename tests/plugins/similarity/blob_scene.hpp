// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two dark blobs whose radiograph is a formula, and images of them.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <marrow/domain/case.hpp>
#include <marrow/domain/functions.hpp>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "shipped.hpp"
#include "tests/plugins/similarity/pixelwise_projector.hpp"

namespace blob_scene {

using marrow::Camera;
using marrow::Cost;
using marrow::List;
using marrow::PixelGrid;
using marrow::RadiographProjector;
using marrow::RigidTransform;
using marrow::View;

/// Line integrals of two blobs, which move by one pixel per millimetre.
inline double blobs(double u, double v) {
  const auto blob = [&](double u0, double v0, double width) {
    return std::exp(-0.5 * ((u - u0) * (u - u0) + (v - v0) * (v - v0)) / (width * width));
  };
  return 40 * blob(90, 80, 9) + 25 * blob(118, 96, 6);
}

class BlobProjector : public pixelwise_projector::PixelwiseProjector {
 public:
  PixelGrid region(const Camera& camera, const RigidTransform& pose) const override {
    const double left = std::max(0.0, std::floor(50 + pose.translation_mm.x())),
                 top = std::max(0.0, std::floor(40 + pose.translation_mm.y()));
    const int columns = int(std::min(100.0, camera.width_px - left)),
              rows = int(std::min(90.0, camera.height_px - top));
    return columns > 0 && rows > 0 ? PixelGrid{left, top, 1, columns, rows} : PixelGrid{};
  }

 protected:
  double integral(const Eigen::Vector2d& pixel, const RigidTransform& pose) const override {
    return blobs(pixel.x() - pose.translation_mm.x(), pixel.y() - pose.translation_mm.y());
  }
};

inline RigidTransform at(double u, double v) {
  RigidTransform pose{"world", "ct"};
  pose.translation_mm = {u, v, 0};
  return pose;
}

/// gain * exp(-slope * blobs) with noise, 16 bits.
inline View view_of(double gain = 50000, double slope = 0.02, double noise = 100, const std::string& name = "frontal") {
  View view;
  view.name = name;
  view.camera.width_px = 200;
  view.camera.height_px = 170;
  view.camera.intrinsics << 1000, 0, 100, 0, 1000, 85, 0, 0, 1;
  view.camera.camera_from_world.translation_mm = {0, 0, 600};
  view.image.pixels = cv::Mat(170, 200, CV_16U);
  std::mt19937 random(3);
  for (int v = 0; v < 170; ++v)
    for (int u = 0; u < 200; ++u) {
      double sum = 0;
      for (int i = 0; i < 12; ++i) sum += double(random()) / 4294967296.0 - 0.5;
      view.image.pixels.at<std::uint16_t>(v, u) =
          std::uint16_t(std::max(0.0, gain * std::exp(-slope * blobs(u, v)) + noise * sum));
    }
  return view;
}

inline List<View> views_of(const View& view) {
  List<View> views;
  views.add(view.name, view);
  return views;
}

}  // namespace blob_scene
