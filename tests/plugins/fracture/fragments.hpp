// SPDX-License-Identifier: Apache-2.0
#pragma once
// A broken shaft whose measures are known: two tubes in the CT, one above the other.
#include "marrow/toolbox/phantom/loft.hpp"
#include "tests/harness/node_test.hpp"

namespace marrow::test::broken_shaft {

/// Its fracture rises by tan(30 degrees) to the patient's left, and a gap of 2 mm is in its middle.
constexpr double kRadius_mm = 14, kRise = 0.57735, kGap_mm = 2;
const Vector3d kFracture_mm(3, -4, 180);

/// A closed tube that ends at the fracture, above (+1) or below it (-1).
inline Mesh tube(double side, double length_mm) {
  Mesh mesh = phantom::tube({0, 0, 0}, {0, 0, length_mm}, kRadius_mm, 96);
  for (Vector3d& vertex : mesh.vertices_mm) {
    if (vertex.z() < 1e-6) vertex.z() += side * kRise * vertex.x();
    vertex.z() = side * (0.5 * kGap_mm + vertex.z());
  }
  if (side < 0)
    for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
  for (Vector3d& vertex : mesh.vertices_mm) vertex += kFracture_mm;
  mesh.frame = "ct";
  return mesh;
}

inline List<Mesh> models() {
  List<Mesh> both;
  both.add("proximal", tube(1, 160));
  both.add("distal", tube(-1, 120));
  return both;
}

/// Where the proximal fragment is in the images.
inline RigidTransform place() { return {"world", "ct", rotation_from_vector({0.4, -0.2, 0.6}), {10, -20, 30}}; }

/// Both poses with their fragments' own axes. The distal fragment has moved in the CT by `motion`.
inline List<Pose> poses(const RigidTransform& motion) {
  List<Pose> both;
  for (const std::string name : {"proximal", "distal"}) {
    Pose pose;
    pose.frame = fragment_frame(*models().find(name));
    pose.world_from_model = name == "distal" ? place() * motion : place();
    both.add(name, pose);
  }
  return both;
}

/// The same poses as from files that hold only a matrix.
inline List<Pose> without_axes(const List<Pose>& given) {
  List<Pose> all;
  for (std::size_t i = 0; i < given.size(); ++i) {
    Pose pose = given[i];
    pose.frame = {};
    all.add(given.name(i), pose);
  }
  return all;
}

/// A rotation about a point of the CT, then a shift.
inline RigidTransform motion(const Matrix3d& turn, const Vector3d& about_mm = kFracture_mm,
                             const Vector3d& shift_mm = Vector3d::Zero()) {
  return {"ct", "ct", turn, about_mm - turn * about_mm + shift_mm};
}

inline Matrix3d turn(double degrees, const Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * std::acos(-1) / 180, axis).toRotationMatrix();
}

inline Inputs inputs(const List<Pose>& poses) {
  return {{"poses", shipped::list(poses, "fragment")}, {"models", shipped::list(models(), "fragment")}};
}

}  // namespace marrow::test::broken_shaft
