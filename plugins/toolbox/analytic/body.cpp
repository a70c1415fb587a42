// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/analytic/body.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace marrow::analytic {
namespace {

/// A vector in the space in which the ellipsoid is the unit ball.
Eigen::Vector3d as_ball(const Ellipsoid& e, const Eigen::Vector3d& vector) {
  return (e.axes.transpose() * vector).cwiseQuotient(e.radii_mm);
}

double chord_mm(const Ellipsoid& e, const Eigen::Vector3d& start, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d p = as_ball(e, start - e.centre_mm), d = as_ball(e, direction);
  const double a = d.squaredNorm(), b = p.dot(d), c = p.squaredNorm() - 1, root = b * b - a * c;
  if (root <= 0) return 0;
  const double from = std::max(0.0, (-b - std::sqrt(root)) / a), to = (-b + std::sqrt(root)) / a;
  return std::max(0.0, to - from);
}

/// The nearest point of the surface is q = r^2 p / (t + r^2), where sum (r p / (t + r^2))^2 = 1. Newton's method finds
/// t, from below.
double signed_distance_mm(const Ellipsoid& e, const Eigen::Vector3d& point, double band) {
  const Eigen::Array3d p = (e.axes.transpose() * (point - e.centre_mm)).array().abs() + 1e-7, r = e.radii_mm.array(),
                       r2 = r * r;
  const double scale = (p / r).matrix().norm(), least = r.minCoeff();
  if ((scale - 1) * least > band) return band;
  if ((1 - scale) * least > band) return -band;
  double t = -1e300;
  for (int k = 0; k < 3; ++k) t = std::max(t, -r2[k] + r[k] * p[k]);
  for (int step = 0; step < 60; ++step) {
    const Eigen::Array3d share = r * p / (t + r2);
    const double excess = share.square().sum() - 1, slope = 2 * (share.square() / (t + r2)).sum();
    if (!(excess > 1e-13)) break;
    t += excess / slope;
  }
  const double distance = (p - r2 * p / (t + r2)).matrix().norm();
  return std::clamp(scale < 1 ? -distance : distance, -band, band);
}

template <class Value>
void fill(const Grid& grid, std::vector<float>& values, const Value& value) {
  values.reserve(grid.count());
  for (int z = 0; z < grid.size[2]; ++z)
    for (int y = 0; y < grid.size[1]; ++y)
      for (int x = 0; x < grid.size[0]; ++x)
        values.push_back(float(value(grid.point_from_index({double(x), double(y), double(z)}))));
}

/// Points at which rays from the source touch an ellipsoid. In the space of the unit ball they form a circle.
std::vector<Eigen::Vector3d> touching_circle(const Ellipsoid& e, const Eigen::Vector3d& source, int count) {
  const Eigen::Vector3d s = as_ball(e, source - e.centre_mm);
  const double distance = s.norm();
  if (!(distance > 1.0001)) return {};
  const Eigen::Vector3d n = s / distance, a = n.unitOrthogonal(), b = n.cross(a);
  const double radius = std::sqrt(1 - 1 / (distance * distance));
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * i / count;
    points.push_back(n / distance + radius * (std::cos(angle) * a + std::sin(angle) * b));
  }
  return points;
}

std::vector<Eigen::Vector2f> pixels_of(const PixelGrid& grid) {
  std::vector<Eigen::Vector2f> pixels;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) pixels.push_back(grid.pixel(column, row).cast<float>());
  return pixels;
}

}  // namespace

double chord_mm(const Body& body, const Eigen::Vector3d& start_mm, const Eigen::Vector3d& direction) {
  double sum = 0;
  for (const Ellipsoid& e : body) sum += chord_mm(e, start_mm, direction);
  return sum;
}

double signed_distance_mm(const Body& body, const Eigen::Vector3d& point_mm, double band_mm) {
  double least = band_mm;
  for (const Ellipsoid& e : body) least = std::min(least, signed_distance_mm(e, point_mm, band_mm));
  return least;
}

Grid grid_of(const std::array<int, 3>& size, const Eigen::Vector3d& spacing_mm, const Eigen::Matrix3d& direction) {
  Grid grid{size, spacing_mm, {}, direction, "ct"};
  grid.origin_mm = -direction * (0.5 * Eigen::Vector3d(size[0] - 1, size[1] - 1, size[2] - 1).cwiseProduct(spacing_mm));
  return grid;
}

Volume volume_of(const Body& body, const Grid& grid, double inside_hu, double outside_hu) {
  Volume volume{grid, {}};
  const double width = grid.spacing_mm.mean();
  fill(grid, volume.values, [&](const Eigen::Vector3d& p) {
    const double inside = std::clamp(0.5 - signed_distance_mm(body, p, width) / width, 0.0, 1.0);
    return outside_hu + inside * (inside_hu - outside_hu);
  });
  return volume;
}

SignedField field_of(const Body& body, const Grid& grid, double band_mm) {
  SignedField field{grid, {}};
  fill(grid, field.values_mm, [&](const Eigen::Vector3d& p) { return signed_distance_mm(body, p, band_mm); });
  return field;
}

Mesh mesh_of(const Body& body) {
  constexpr int kRings = 81, kAround = 120;
  Mesh mesh;
  for (const Ellipsoid& e : body) {
    const auto first = std::uint32_t(mesh.vertices_mm.size());
    const auto add = [&](const Eigen::Vector3d& p) {
      mesh.vertices_mm.push_back(e.centre_mm + e.axes * p.cwiseProduct(e.radii_mm));
    };
    add({0, 0, -1});
    add({0, 0, 1});
    for (int i = 1; i < kRings; ++i)
      for (int k = 0; k < kAround; ++k) {
        const double tilt = kPi * i / kRings, angle = 2 * kPi * k / kAround;
        add({std::sin(tilt) * std::cos(angle), std::sin(tilt) * std::sin(angle), -std::cos(tilt)});
      }
    const auto at = [&](int ring, int k) { return first + 2 + std::uint32_t((ring - 1) * kAround + k % kAround); };
    for (int k = 0; k < kAround; ++k) {
      mesh.triangles.push_back({first, at(1, k + 1), at(1, k)});
      mesh.triangles.push_back({first + 1, at(kRings - 1, k), at(kRings - 1, k + 1)});
      for (int i = 1; i + 1 < kRings; ++i) {
        mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
        mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
      }
    }
  }
  return mesh;
}

Camera c_arm(double angle_deg, int width_px, int height_px, double pixel_mm) {
  Camera camera;
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.intrinsics << 1000 / pixel_mm, 0, 0.5 * (width_px - 1), 0, 1000 / pixel_mm, 0.5 * (height_px - 1), 0, 0, 1;
  const double a = radians(angle_deg);
  camera.camera_from_world.rotation << std::cos(a), -std::sin(a), 0, 0, 0, -1, std::sin(a), std::cos(a), 0;
  camera.camera_from_world.translation_mm = {0, 0, 600};
  return camera;
}

RigidTransform moved_by(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm) {
  return {"world", "ct", rotation_from_vector(turn_rad), shift_mm};
}

std::vector<OutlinePoint> BodyProjector::outline(const Camera& camera, const RigidTransform& world_from_model,
                                                 double spacing_px) const {
  constexpr int kCount = 1440;
  const RigidTransform camera_from_model = camera.camera_from_world * world_from_model;
  const Eigen::Vector3d source = inverse(camera_from_model).translation_mm;
  const Eigen::Matrix3d line_from_normal = camera.intrinsics.inverse().transpose() * camera_from_model.rotation;
  std::vector<OutlinePoint> points;
  for (std::size_t i = 0; i < body_.size(); ++i) {
    const Ellipsoid& e = body_[i];
    Body rest = body_;
    rest.erase(rest.begin() + std::ptrdiff_t(i));
    Eigen::Vector2d last;
    double passed = spacing_px;
    bool is_first = true;
    for (const Eigen::Vector3d& q : touching_circle(e, source, kCount)) {
      const Eigen::Vector3d at = e.centre_mm + e.axes * q.cwiseProduct(e.radii_mm),
                            seen = camera.intrinsics * (camera_from_model * at);
      if (!(seen.z() > 0)) continue;
      const Eigen::Vector2d pixel = seen.hnormalized();
      passed += is_first ? 0 : (pixel - last).norm();
      last = pixel;
      is_first = false;
      if (passed < spacing_px) continue;
      passed = std::fmod(passed, spacing_px);
      const bool is_inside =
          pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width_px - 1 && pixel.y() <= camera.height_px - 1;
      if (!is_inside || chord_mm(rest, source, (at - source).normalized()) > 0) continue;
      const Eigen::Vector2d normal = (line_from_normal * (e.axes * q.cwiseQuotient(e.radii_mm))).head<2>().normalized();
      points.push_back({float(pixel.x()), float(pixel.y()), float(normal.x()), float(normal.y()), at.cast<float>()});
    }
  }
  return points;
}

std::vector<float> BodyProjector::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                             const PixelGrid& grid) const {
  return radiograph(camera, world_from_model, pixels_of(grid));
}

std::vector<float> BodyProjector::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                             const std::vector<Eigen::Vector2f>& pixels) const {
  const std::vector<double> values = integrals(camera, world_from_model, pixels);
  return {values.begin(), values.end()};
}

std::optional<RadiographExpansion> BodyProjector::expansion(const Camera& camera,
                                                            const RigidTransform& world_from_model,
                                                            const FragmentFrame& frame, const PixelGrid& grid) const {
  constexpr double kStep_mm = 2.5e-4, kStep_rad = 1e-5;
  const std::vector<Eigen::Vector2f> pixels = pixels_of(grid);
  RadiographExpansion expansion{radiograph(camera, world_from_model, pixels), {}};
  for (int k = 0; k < 6; ++k) {
    const double step = k < 3 ? kStep_rad : kStep_mm;
    const Vector6d motion = step * Vector6d::Unit(k);
    const std::vector<double> above = integrals(camera, moved(world_from_model, frame, motion), pixels),
                              below = integrals(camera, moved(world_from_model, frame, -motion), pixels);
    for (std::size_t i = 0; i < pixels.size(); ++i)
      expansion.slopes[std::size_t(k)].push_back(float((above[i] - below[i]) / (2 * step)));
  }
  return expansion;
}

std::vector<double> BodyProjector::integrals(const Camera& camera, const RigidTransform& world_from_model,
                                             const std::vector<Eigen::Vector2f>& pixels) const {
  const RigidTransform model_from_camera = inverse(camera.camera_from_world * world_from_model);
  const Eigen::Matrix3d ray_from_pixel = model_from_camera.rotation * camera.intrinsics.inverse();
  std::vector<double> values;
  values.reserve(pixels.size());
  for (const Eigen::Vector2f& pixel : pixels) {
    const Eigen::Vector3d direction =
        (ray_from_pixel * Eigen::Vector3d(double(pixel.x()), double(pixel.y()), 1)).normalized();
    values.push_back(density_ * chord_mm(body_, model_from_camera.translation_mm, direction));
  }
  return values;
}

PixelGrid BodyProjector::region(const Camera& camera, const RigidTransform& world_from_model) const {
  const Eigen::Vector3d source = inverse(camera.camera_from_world * world_from_model).translation_mm;
  Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
  for (const Ellipsoid& e : body_)
    for (const Eigen::Vector3d& q : touching_circle(e, source, 360)) {
      const Eigen::Vector2d pixel =
          project(camera, world_from_model * (e.centre_mm + e.axes * q.cwiseProduct(e.radii_mm)));
      if (!pixel.allFinite()) continue;
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
  const int left = int(std::floor(std::clamp(low.x() - 1, 0.0, 1e6))),
            top = int(std::floor(std::clamp(low.y() - 1, 0.0, 1e6)));
  const int right = int(std::ceil(std::clamp(high.x() + 1, -1.0, camera.width_px - 1.0))),
            bottom = int(std::ceil(std::clamp(high.y() + 1, -1.0, camera.height_px - 1.0)));
  if (right < left || bottom < top) return {};
  return {double(left), double(top), 1, right - left + 1, bottom - top + 1};
}

}  // namespace marrow::analytic
