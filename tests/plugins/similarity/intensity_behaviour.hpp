// SPDX-License-Identifier: Apache-2.0
#pragma once
// What every cost of grey values must do, on two dark blobs whose radiograph is a formula.
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

namespace intensity_behaviour {

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

/// The cost that a node gives with its defaults. It refers to the projector.
inline std::shared_ptr<const Cost> make(const std::string& node, const std::shared_ptr<const BlobProjector>& projector,
                                        const List<View>& views) {
  const shipped::Inputs inputs{{"projector", marrow::Value::of<RadiographProjector>(projector)},
                               {"views", shipped::list(views, "view")}};
  return std::static_pointer_cast<const Cost>(shipped::call(node, inputs).at("cost").data);
}

/// The cost is least at the true pose and rises with the distance from it. Some costs are least there but do not fall
/// towards it from far away (`has_slope` is false).
inline void is_best_at_the_truth(const std::string& node, bool has_slope = true) {
  const auto projector = std::make_shared<const BlobProjector>();
  const auto cost = make(node, projector, views_of(view_of()));
  const double best = cost->value(at(0, 0));
  for (const auto& [u, v] : std::vector<std::pair<double, double>>{{1, 0}, {0, 1}, {-0.7, 0.7}}) {
    double before = best;
    for (const double distance : {2.0, 4.0, 7.0}) {
      const double value = cost->value(at(distance * u, distance * v));
      EXPECT_GT(value, before) << "off by " << distance * u << ", " << distance * v;
      if (has_slope) before = value;
    }
  }
}

inline void is_unmoved_by_brightness(const std::string& node) {
  const auto projector = std::make_shared<const BlobProjector>();
  const auto one = make(node, projector, views_of(view_of(50000, 0.02, 0))),
             darker = make(node, projector, views_of(view_of(25000, 0.02, 0)));
  EXPECT_NEAR(one->value(at(3, 2)), darker->value(at(3, 2)), 0.01);
}

/// If there is nothing to compare, the cost is the worst, and never NaN.
inline void nothing_is_the_worst(const std::string& node, double worst) {
  const auto projector = std::make_shared<const BlobProjector>();
  View view = view_of();
  EXPECT_EQ(make(node, projector, views_of(view))->value(at(500, 0)), worst) << "out of the image";
  View constant = view;
  constant.image.pixels = cv::Mat(170, 200, CV_16U, cv::Scalar(30000));
  const double even = make(node, projector, views_of(constant))->value(at(0, 0));
  EXPECT_TRUE(std::isfinite(even));
  EXPECT_GT(even, make(node, projector, views_of(view))->value(at(0, 0)));
  View masked = view;
  masked.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(0));
  EXPECT_TRUE(std::isfinite(make(node, projector, views_of(masked))->value(at(0, 0))));
  View few = masked;
  few.mask(cv::Rect(89, 79, 3, 3)).setTo(1);
  EXPECT_EQ(make(node, projector, views_of(few))->value(at(0, 0)),
            make(node, projector, views_of(masked))->value(at(0, 0)))
      << "nine pixels say no more than none";
  View black = view;
  black.image.pixels = cv::Mat(170, 200, CV_16U, cv::Scalar(0));
  EXPECT_TRUE(std::isfinite(make(node, projector, views_of(black))->value(at(0, 0))));
  View nan = view;
  view.image.pixels.convertTo(nan.image.pixels, CV_32F);
  nan.image.pixels.at<float>(80, 90) = std::nanf("");
  EXPECT_TRUE(std::isfinite(make(node, projector, views_of(nan))->value(at(0, 0))))
      << "a pixel that is not a number is left out";
}

inline void levels_compare_fewer_pixels(const std::string& node) {
  const auto projector = std::make_shared<const BlobProjector>();
  const auto cost = make(node, projector, views_of(view_of()))->at_level({1, 1, 4});
  EXPECT_LT(cost->value(at(0, 0)), cost->value(at(5, 0)));
  const auto same = make(node, projector, views_of(view_of()));
  EXPECT_EQ(same->at_level({1, 1, 0})->value(at(1, 0)), same->value(at(1, 0)));
}

inline void refuses_nonsense(const std::string& node) {
  const auto projector = std::make_shared<const BlobProjector>();
  View broken = view_of();
  broken.camera.width_px = 10;
  EXPECT_THROW(make(node, projector, views_of(broken)), marrow::Error);
  EXPECT_THROW(make(node, projector, {}), marrow::Error);
}

/// A cost gives no blocks if they say nothing about its error. So no deviations are predicted from it.
inline void has_no_blocks(const std::string& node) {
  const auto projector = std::make_shared<const BlobProjector>();
  const auto cost = make(node, projector, views_of(view_of()));
  EXPECT_EQ(cost->without_each_block(at(1, 0.5)), std::vector<double>());
  EXPECT_EQ(cost->at_level({4, 8, 1})->without_each_block(at(1, 0.5)), std::vector<double>());
}

/// The cost without a block equals the cost with a mask that excludes the block.
inline void blocks_are_masks(const std::string& node) {
  const auto projector = std::make_shared<const BlobProjector>();
  const View whole = view_of();
  const auto cost = make(node, projector, views_of(whole));
  const std::vector<double> without = cost->without_each_block(at(1, 0.5));
  ASSERT_EQ(without.size(), 8u * 7) << "of 25 px";
  for (const int block : {7, 20, 28, 35}) {
    View view = whole;
    view.mask = cv::Mat(170, 200, CV_8U, cv::Scalar(255));
    cv::rectangle(view.mask, cv::Rect(block % 8 * 25, block / 8 * 25, 25, 25), 0, cv::FILLED);
    EXPECT_NEAR(without[std::size_t(block)], make(node, projector, views_of(view))->value(at(1, 0.5)), 1e-12) << block;
  }
  EXPECT_EQ(without[7], cost->value(at(1, 0.5)));
  EXPECT_NE(without[28], cost->value(at(1, 0.5)));
}

}  // namespace intensity_behaviour
