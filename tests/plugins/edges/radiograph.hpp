// SPDX-License-Identifier: Apache-2.0
#pragma once
// X-ray images of cylinders and balls by the exact length of each ray inside them: a shaft with its canal in a thigh,
// with condyles, seen by a pinhole camera.

#include "shipped.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::radiograph {

/// A C-arm view: source 600 mm before the isocentre, detector of size_px^2 pixels over 300 mm at 1000 mm. At 0 degrees
/// the rays run along +y with the patient's left on the right and the head up; the angle turns about z.
inline Camera camera(double angle_deg, int size_px = 512) {
  Camera camera = before_origin(pinhole(1000.0 / (300.0 / size_px), size_px, size_px), 600);
  Matrix3d upright;
  upright << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  camera.camera_from_world.rotation =
      upright * Eigen::AngleAxisd(radians(angle_deg), Vector3d::UnitZ()).toRotationMatrix();
  return camera;
}

/// Attenuation relative to what surrounds the body: muscle 0.024, cortical bone 0.08, marrow 0.021 per mm.
struct Cylinder {
  Vector3d point, direction;
  double radius_mm, added_per_mm;
};
struct Ball {
  Vector3d centre;
  double radius_mm, added_per_mm;
};
struct Scene {
  std::vector<Cylinder> cylinders;
  std::vector<Ball> balls;
};

/// Length of the ray source + t * ray (unit) inside a cylinder or ball, from the roots of its quadratic.
inline double chord_mm(const Vector3d& source, const Vector3d& ray, const Cylinder& body) {
  const Vector3d across = ray - body.direction * ray.dot(body.direction);
  const Vector3d from = source - body.point, start = from - body.direction * from.dot(body.direction);
  const double a = across.squaredNorm(), b = across.dot(start),
               c = start.squaredNorm() - body.radius_mm * body.radius_mm;
  return 2 * std::sqrt(std::max(0.0, b * b - a * c)) / a;
}
inline double chord_mm(const Vector3d& source, const Vector3d& ray, const Ball& body) {
  const Vector3d from = source - body.centre;
  const double b = ray.dot(from), c = from.squaredNorm() - body.radius_mm * body.radius_mm;
  return 2 * std::sqrt(std::max(0.0, b * b - c));
}

/// A shaft of 28 mm with a canal of 12 mm along `direction` through `point`, in a thigh of 150 mm.
inline Scene shaft(const Vector3d& point, const Vector3d& direction, double outer_mm = 28, double canal_mm = 12) {
  Scene scene;
  scene.cylinders = {{Vector3d(0, 0, 0), Vector3d::UnitZ(), 75, 0.024},
                     {point, direction.normalized(), outer_mm / 2, 0.08 - 0.024},
                     {point, direction.normalized(), canal_mm / 2, 0.021 - 0.08}};
  return scene;
}

/// 16 bit image with 60000 grey values and `photons` per pixel (0: no noise) beside the body; each pixel is the mean
/// over 3 x 3 rays.
inline View image(const std::string& name, const Camera& camera, const Scene& scene, double photons, unsigned seed) {
  View view = view_of(name, camera, cv::Mat(camera.height_px, camera.width_px, CV_16U));
  const Vector3d source = source_position_mm(camera);
  const Matrix3d world_from_pixel = camera.camera_from_world.rotation.transpose() * camera.intrinsics.inverse();
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  for (int v = 0; v < camera.height_px; ++v)
    for (int u = 0; u < camera.width_px; ++u) {
      double mean = 0;
      for (int k = 0; k < 9; ++k) {
        const Vector3d ray =
            (world_from_pixel * Vector3d(u + (k % 3 - 1) / 3.0, v + (k / 3 - 1) / 3.0, 1)).normalized();
        double path = 0;
        for (const Cylinder& body : scene.cylinders) path += body.added_per_mm * chord_mm(source, ray, body);
        for (const Ball& body : scene.balls) path += body.added_per_mm * chord_mm(source, ray, body);
        mean += std::exp(-path) / 9;
      }
      if (photons > 0) mean = std::max(0.0, mean + normal(random) * std::sqrt(mean / photons));
      view.image.pixels.at<std::uint16_t>(v, u) = cv::saturate_cast<std::uint16_t>(60000 * mean);
    }
  return view;
}

}  // namespace marrow::test::radiograph

namespace radiograph = marrow::test::radiograph;

namespace edges {

// Images whose edges are known exactly, and the detectors that shall find them.
/// A view of an image whose brightness at a point is function(u, v); each pixel is the mean over 8 x 8 points.
template <class Function>
marrow::View drawn(int size, Function function, double noise = 0, unsigned seed = 1) {
  marrow::View view = marrow::test::view_of("frontal", radiograph::camera(0, size), cv::Mat(size, size, CV_16U));
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
