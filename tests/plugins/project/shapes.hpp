// SPDX-License-Identifier: Apache-2.0
#pragma once
// Surfaces and cameras for the tests of projectors, costs and registration.
#include "tests/harness/cameras.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::shapes {

/// A closed surface around an axis parallel to z: rings of points centre(z) + r(theta, z) in planes from z = 0 to
/// `length`.
inline Mesh around_axis(double length_mm, int rings, int around, const std::function<Vector2d(double)>& centre,
                        const std::function<double(double, double)>& radius) {
  Mesh mesh;
  for (int i = 0; i < rings; ++i) {
    const double z = length_mm * i / (rings - 1);
    for (int k = 0; k < around; ++k) {
      const double angle = 2 * kPi * k / around, r = radius(angle, z);
      mesh.vertices_mm.emplace_back(centre(z).x() + r * std::cos(angle), centre(z).y() + r * std::sin(angle), z);
    }
  }
  const auto at = [&](int ring, int k) { return std::uint32_t(ring * around + k % around); };
  for (int i = 0; i + 1 < rings; ++i)
    for (int k = 0; k < around; ++k) {
      mesh.triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k + 1)});
      mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i + 1, k)});
    }
  for (const int ring : {0, rings - 1}) {
    const double z = length_mm * ring / (rings - 1);
    const auto middle = std::uint32_t(mesh.vertices_mm.size());
    mesh.vertices_mm.emplace_back(centre(z).x(), centre(z).y(), z);
    for (int k = 0; k < around; ++k) {
      if (ring == 0)
        mesh.triangles.push_back({middle, at(0, k + 1), at(0, k)});
      else
        mesh.triangles.push_back({middle, at(ring, k), at(ring, k + 1)});
    }
  }
  return mesh;
}

/// The distal 200 mm of a femur-like bone: bowed, tapered, thicker from front to back, with a ridge behind and two
/// unequal condyles below. +x to the left, +y to the back, +z to the head; about 70,000 triangles.
inline Mesh distal_femur() {
  const auto bump = [](double angle, double at, double width) {
    return std::exp(-std::pow(std::remainder(angle - at, 2 * kPi) / width, 2));
  };
  const auto radius = [&](double angle, double z) {
    const double widening = std::pow(std::clamp((80 - z) / 80, 0.0, 1.0), 1.5);
    double r = 14 - 0.4 * std::cos(2 * angle) + 0.005 * std::max(0.0, 120 - z);
    r += 3.5 * (1 - widening) * bump(angle, kPi / 2, 0.25);
    r += widening *
         (26 * bump(angle, radians(35), 0.8) + 22 * bump(angle, radians(140), 0.75) + 8 * bump(angle, -kPi / 2, 1.0));
    const double rounding = std::clamp((25 - z) / 25, 0.0, 0.999);
    return r * std::sqrt(1 - rounding * rounding);
  };
  return around_axis(
      200, 251, 140, [](double z) { return Vector2d(0, (z - 100) * (z - 100) / 1800); }, radius);
}

inline Mesh cylinder(double radius_mm, double length_mm, int around = 200) {
  return around_axis(
      length_mm, 101, around, [](double) { return Vector2d(0, 0); }, [&](double, double) { return radius_mm; });
}

/// Its lowest point at the origin.
inline Mesh sphere(double radius_mm) {
  constexpr int kRings = 161;
  Mesh mesh = around_axis(
      kRings - 1, kRings, 300, [](double) { return Vector2d(0, 0); },
      [&](double, double ring) { return radius_mm * std::max(1e-4, std::sin(kPi * ring / (kRings - 1))); });
  for (auto& v : mesh.vertices_mm) v.z() = radius_mm * (1 - std::cos(kPi * v.z() / (kRings - 1)));
  return mesh;
}

using test::c_arm;

/// Puts a model point at the isocentre.
inline RigidTransform centred_at(const Vector3d& model_mm) {
  RigidTransform world_from_model{"world", "ct"};
  world_from_model.translation_mm = -model_mm;
  return world_from_model;
}

}  // namespace marrow::test::shapes

namespace shapes = marrow::test::shapes;
