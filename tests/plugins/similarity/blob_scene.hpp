// SPDX-License-Identifier: Apache-2.0
#pragma once
// Two dark blobs whose radiograph is a formula, images of them, and another fragment in these images: a square.
#include "tests/harness/node_test.hpp"

namespace marrow::test::blob_scene {

constexpr int kWidth_px = 200, kHeight_px = 170;

/// Line integrals of two blobs, which move by one pixel per millimetre.
inline double blobs(double u, double v) {
  const auto blob = [&](double u0, double v0, double width) {
    return std::exp(-0.5 * ((u - u0) * (u - u0) + (v - v0) * (v - v0)) / (width * width));
  };
  return 40 * blob(90, 80, 9) + 25 * blob(118, 96, 6);
}

inline Value blob_projector(const DrawnRadiograph::Region& region) {
  return function<RadiographProjector>(
      std::make_shared<const DrawnRadiograph>(region, [](const Vector2d& pixel, const RigidTransform& pose) {
        return blobs(pixel.x() - pose.translation_mm.x(), pixel.y() - pose.translation_mm.y());
      }));
}
/// The region of the two blobs, cut to the image.
inline PixelGrid blob_region(const RigidTransform& pose) {
  const double left = std::max(0.0, std::floor(50 + pose.translation_mm.x())),
               top = std::max(0.0, std::floor(40 + pose.translation_mm.y()));
  const int columns = int(std::min(100.0, kWidth_px - left)), rows = int(std::min(90.0, kHeight_px - top));
  return columns > 0 && rows > 0 ? PixelGrid{left, top, 1, columns, rows} : PixelGrid{};
}

inline RigidTransform at(double u, double v) { return placed({u, v, 0}); }

inline Camera camera() { return before_origin(pinhole(1000, kWidth_px, kHeight_px, {{100, 85}}), 600); }

/// gain * exp(-slope * blobs) with noise, 16 bits.
inline View view_of(double gain = 50000, double slope = 0.02, double noise = 100, const std::string& name = "frontal") {
  std::mt19937 random(3);
  return test::view_of(name, camera(), image_of<std::uint16_t>(kWidth_px, kHeight_px, [&](int u, int v) {
                         double sum = 0;
                         for (int i = 0; i < 12; ++i) sum += double(random()) / 4294967296.0 - 0.5;
                         return std::max(0.0, gain * std::exp(-slope * blobs(u, v)) + noise * sum);
                       }));
}
inline View with_mask(View view, const cv::Mat& mask) {
  view.mask = mask;
  return view;
}
/// The same with even grey values.
inline View even(View view, double grey) {
  view.image.pixels = cv::Mat(kHeight_px, kWidth_px, CV_16U, cv::Scalar(grey));
  return view;
}

/// The blobs in one view.
inline Inputs inputs(const View& view = view_of()) {
  return {{"projector", blob_projector(blob_region)}, {"views", each_view(view)}};
}

/// An upright line that faces left, at a column plus the pose's x in mm.
inline std::shared_ptr<const OutlineProjector> upright_line(double u_px, double from_v, double to_v) {
  return outline_of([=](const Camera&, const RigidTransform& pose, double spacing_px) {
    std::vector<OutlinePoint> points;
    for (double v = from_v; v < to_v; v += spacing_px)
      points.push_back({float(u_px + pose.translation_mm.x()), float(v + pose.translation_mm.z()), -1, 0});
    return points;
  });
}

/// A square of shadow, wherever the pose is.
inline std::shared_ptr<const RadiographProjector> square_shadow() {
  return std::make_shared<const DrawnRadiograph>(PixelGrid{95, 55, 1, 40, 40}, [](const Vector2d& p, const auto&) {
    return p.x() >= 100 && p.x() < 130 && p.y() >= 60 && p.y() < 90 ? 10 : 0;
  });
}
/// The same square as an outline that is open below. It moves by one pixel per millimetre.
inline std::shared_ptr<const OutlineProjector> square_outline() {
  return outline_of([](const Camera&, const RigidTransform& pose, double spacing_px) {
    const double left = 100 + pose.translation_mm.x();
    std::vector<OutlinePoint> points;
    for (double at = 0; at < 30; at += spacing_px) {
      points.push_back({float(left), float(60 + at), -1, 0});
      points.push_back({float(left + 29), float(60 + at), 1, 0});
      points.push_back({float(left + at), 60, 0, -1});
    }
    return points;
  });
}

/// Two fragments: the own one, whose pose is not known yet, and another at a different place.
template <class Projector>
Inputs beside_another(const Inputs& inputs, std::shared_ptr<const Projector> own,
                      std::shared_ptr<const Projector> other) {
  List<Projector> projectors;
  projectors.add_shared("own", own);
  projectors.add_shared("other", std::move(other));
  return with(inputs, {{"projector", Value::of<Projector>(std::move(own))},
                       {"other_projectors", list(projectors, "fragment")},
                       {"others", per_fragment("other", Pose())}});
}
/// Another fragment, known only as an outline.
inline Inputs beside_outline(const Inputs& inputs, const std::string& name = "other") {
  List<OutlineProjector> outlines;
  outlines.add_shared(name, square_outline());
  return with(inputs, {{"other_outlines", list(outlines, "fragment")}, {"others", per_fragment(name, Pose())}});
}

}  // namespace marrow::test::blob_scene
