// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "tests/harness/node_test.hpp"

namespace marrow::test::tube {

/// A closed tube along z from -half to +half length. radius(z, angle) and centre(z) [mm] give its shape.
template <class Radius, class Centre>
Mesh mesh(double half_mm, Radius radius, Centre centre, int sides = 180, int rings = 120) {
  Mesh mesh;
  const auto add = [&](const Vector3d& point) {
    mesh.vertices_mm.push_back(point);
    return std::uint32_t(mesh.vertices_mm.size() - 1);
  };
  for (int ring = 0; ring <= rings; ++ring) {
    const double z = half_mm * (2.0 * ring / rings - 1);
    for (int side = 0; side < sides; ++side) {
      const double angle = 2 * kPi * side / sides, r = radius(z, angle);
      add(centre(z) + Vector3d(r * std::cos(angle), r * std::sin(angle), z));
    }
  }
  const auto at = [&](int ring, int side) { return std::uint32_t(ring * sides + side % sides); };
  const std::uint32_t bottom = add(centre(-half_mm) + Vector3d(0, 0, -half_mm)),
                      top = add(centre(half_mm) + Vector3d(0, 0, half_mm));
  for (int side = 0; side < sides; ++side) {
    for (int ring = 0; ring < rings; ++ring) {
      mesh.triangles.push_back({at(ring, side), at(ring, side + 1), at(ring + 1, side + 1)});
      mesh.triangles.push_back({at(ring, side), at(ring + 1, side + 1), at(ring + 1, side)});
    }
    mesh.triangles.push_back({bottom, at(0, side + 1), at(0, side)});
    mesh.triangles.push_back({top, at(rings, side), at(rings, side + 1)});
  }
  return mesh;
}

inline Mesh cylinder(double radius_mm, double half_mm) {
  return mesh(
      half_mm, [=](double, double) { return radius_mm; }, [](double) { return Vector3d(0, 0, 0); });
}

inline RigidTransform posed(const Vector3d& rotation_deg, const Vector3d& translation_mm) {
  return {"world", "ct", rotation_from_vector(rotation_deg * (kPi / 180)), translation_mm};
}

/// The two image lines in which planes through the source touch a circular cylinder, between the images of two of its
/// points.
inline std::array<Vector3d, 2> tangents(const Camera& camera, const Vector3d& point, const Vector3d& direction,
                                        double radius_mm) {
  const Vector3d source = source_position_mm(camera), d = direction.normalized();
  Vector3d to_axis = point - source;
  to_axis -= d * d.dot(to_axis);
  const double distance = to_axis.norm(), sine = radius_mm / distance, cosine = std::sqrt(1 - sine * sine);
  const Vector3d towards = to_axis / distance, across = d.cross(towards);
  std::array<Vector3d, 2> lines;
  for (int side = 0; side < 2; ++side) {
    const Vector3d normal = (side ? -1.0 : 1.0) * cosine * across - sine * towards;  // of the tangent plane
    lines[side] = camera.intrinsics.inverse().transpose() * (camera.camera_from_world.rotation * normal);
  }
  return lines;
}

/// Point of an image line at height v.
inline Vector2d at_height(const Vector3d& line, double v) { return {-(line.y() * v + line.z()) / line.x(), v}; }

/// Exact borders between two heights of the image, as shaft lines.
inline ShaftLines borders(const Camera& camera, const Vector3d& point, const Vector3d& direction, double radius_mm,
                          double from_v, double to_v) {
  const auto lines = tangents(camera, point, direction, radius_mm);
  ShaftLines shaft;
  shaft.left = {at_height(lines[0], from_v), at_height(lines[0], to_v)};
  shaft.right = {at_height(lines[1], from_v), at_height(lines[1], to_v)};
  if (shaft.left.from_px.x() < shaft.right.from_px.x())
    std::swap(shaft.left, shaft.right);  // they run down, so left is at larger u
  return shaft;
}

}  // namespace marrow::test::tube
