// SPDX-License-Identifier: Apache-2.0
#pragma once
// Analytic fields, and counts on meshes, that the tests of this kind share.
#include "tests/harness/node_test.hpp"

namespace marrow::test::mesh_shapes {

using Distance = std::function<double(const Vector3d&)>;

inline double sphere(const Vector3d& p, double radius_mm) { return p.norm() - radius_mm; }
inline double torus(const Vector3d& p, double ring_mm, double tube_mm) {
  return std::hypot(std::hypot(p.x(), p.y()) - ring_mm, p.z()) - tube_mm;
}

/// A grid of CT-like spacing in a turned frame, centred on the origin.
inline Grid turned_grid(std::array<int, 3> size) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = {0.8, 0.8, 1.0};
  grid.direction = Eigen::AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  grid.frame = "scanner";
  const Vector3d middle = Vector3d(size[0] - 1, size[1] - 1, size[2] - 1) / 2.0;
  grid.origin_mm = -(grid.direction * middle.cwiseProduct(grid.spacing_mm)) + Vector3d(0.13, -0.21, 0.07);
  return grid;
}

inline SignedField sphere_field(double radius_mm = 15, std::array<int, 3> size = {48, 48, 40}) {
  return field_by(turned_grid(size), [=](const Vector3d& p) { return sphere(p, radius_mm); });
}

/// A hollow ball with a speck beside it.
inline SignedField shell_and_speck() {
  return field_by(turned_grid({64, 64, 52}), [](const Vector3d& p) {
    return std::min(std::abs(p.norm() - 12) - 2, (p - Vector3d(0, 0, 19)).norm() - 3);
  });
}

/// A cylinder that the border cuts at both ends.
inline SignedField cut_cylinder() {
  return field_by(grid_at({40, 40, 11}, {0, 0, 0}, {1, 1, 2}),
                  [](const Vector3d& p) { return std::hypot(p.x() - 19.7, p.y() - 19.4) - 10; });
}

/// A field of noise: all 256 patterns of a cell occur, with every kind of neighbour. `inside_part`: the share of
/// samples inside.
inline SignedField noise_field(std::array<int, 3> size, unsigned seed, double inside_part = 0.5) {
  SignedField field;
  field.grid.size = size;
  std::mt19937 random(seed);
  for (std::size_t i = 0; i < field.grid.count(); ++i)
    field.values_mm.push_back(float(random()) / float(std::mt19937::max()) - float(inside_part));
  return field;
}

/// A cell with the pattern's signs (bit c: corner c is inside). All other samples of the field are on one side.
inline SignedField pattern_field(unsigned pattern, bool inside_around) {
  SignedField field;
  field.grid.size = {4, 4, 4};
  field.values_mm.assign(64, inside_around ? -0.8f : 0.6f);
  for (int c = 0; c < 8; ++c)
    field.values_mm[field.grid.offset(1 + (c & 1), 1 + (c >> 1 & 1), 1 + (c >> 2))] = pattern >> c & 1 ? -0.7f : 0.9f;
  return field;
}

/// Two thick walls a sample apart, which a mesher may not join, in a grid of CT-like spacing.
inline double two_slabs(const Vector3d& p, double gap_mm) {
  const Vector3d half(12, 12, 4);
  const auto box = [&](const Vector3d& q) { return (q.cwiseAbs() - half).maxCoeff(); };
  const double shift_mm = half.z() + gap_mm / 2;
  return std::min(box(p - Vector3d(0, 0, shift_mm)), box(p + Vector3d(0, 0, shift_mm)));
}

/// The mesh that a node makes from a field.
inline Mesh meshed(const std::string& node, const SignedField& field, const Options& options = {}) {
  return output<Mesh>(node, "mesh", {{"field", item(field)}}, options);
}

/// Euler's number of a closed mesh: vertices - edges + faces, 2 for a sphere, 0 for a torus.
inline long euler_number(const Mesh& mesh) {
  return long(mesh.vertices_mm.size()) - long(mesh.triangles.size()) * 3 / 2 + long(mesh.triangles.size());
}

inline double largest_error_mm(const Mesh& mesh, const Distance& distance_mm) {
  double largest = 0;
  for (const auto& vertex : mesh.vertices_mm) largest = std::max(largest, std::abs(distance_mm(vertex)));
  return largest;
}

/// Whether the normal of every triangle with an area points to larger distances.
inline bool normals_point_outward(const Mesh& mesh, const Distance& distance_mm) {
  for (const auto& t : mesh.triangles) {
    const Vector3d a = mesh.vertices_mm[t[0]], b = mesh.vertices_mm[t[1]], c = mesh.vertices_mm[t[2]];
    const Vector3d normal = (b - a).cross(c - a);
    if (normal.norm() < 1e-3) continue;
    const Vector3d middle = (a + b + c) / 3, step = 0.1 * normal.normalized();
    if (distance_mm(middle + step) <= distance_mm(middle - step)) return false;
  }
  return true;
}

}  // namespace marrow::test::mesh_shapes
