// SPDX-License-Identifier: Apache-2.0
#pragma once
// A case of three views and two fragments, whose numbers are not short ones.
#include <opencv2/core.hpp>
#include <string>

#include "marrow/domain/case.hpp"

namespace example_case {

inline marrow::View example_view(const std::string& name, int type, double turn) {
  marrow::View view;
  view.name = name;
  view.image.pixels = cv::Mat(5, 7, type);
  cv::randu(view.image.pixels, 0, type == CV_8U ? 255 : 60000);
  view.camera = {7, 5, Eigen::Matrix3d::Identity(), {"camera", "world"}};
  view.camera.intrinsics << 1706.484 / 3, 0, 3.1, 0, 1706.484 / 3, 2.1, 0, 0, 1;
  view.camera.camera_from_world.rotation = marrow::rotation_from_vector({0.1, turn, -0.3});
  view.camera.camera_from_world.translation_mm = {0.1, -1.0 / 3, 600};
  return view;
}

inline marrow::Case example() {
  marrow::Case value;
  value.ct.grid.size = {4, 3, 2};
  value.ct.grid.spacing_mm = {0.8, 0.8, 1.0 / 3};
  value.ct.grid.origin_mm = {-12.1, 7.3, 1e-3};
  value.ct.grid.direction = marrow::rotation_from_vector({0.01, 0.02, 0.03});
  for (int i = 0; i < 24; ++i) value.ct.values.push_back(float(i) * 1.1f - 1000);
  value.views.add("frontal", example_view("frontal", CV_16U, 0.7));
  value.views.add("lateral", example_view("lateral", CV_8U, 1.7));
  marrow::View masked = example_view("60 degrees / oblique", CV_32F, 2.7);
  masked.mask = cv::Mat(5, 7, CV_8U, cv::Scalar(255));
  value.views.add(masked.name, masked);
  value.seeds.add("proximal", {"proximal", {{1, 2, 3}}, false});
  value.seeds.add("distal", {"distal", {{0.1, 0.2, 0.3}, {1.0 / 3, 2.0 / 3, 1e-9}}, true});
  marrow::Pose start;
  start.world_from_model.rotation = marrow::rotation_from_vector({0.1, 0.2, 0.3});
  start.world_from_model.translation_mm = {1.0 / 7, -2.0 / 7, 3e5 / 7};
  value.start.add("distal", start);
  marrow::Truth truth;
  truth.world_from_model.rotation = marrow::rotation_from_vector({-0.4, 0.2, 0.3});
  truth.world_from_model.translation_mm = {1e-17, 1e17, 0.1};
  value.truth.add("distal", truth);
  return value;
}

}  // namespace example_case
