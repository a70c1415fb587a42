// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values of the mirrored patient: x changes its sign in the world, in the CT, in the bone and in the robot's base. Only
// the definitions of the values are used, no node.
#include <gtest/gtest.h>

#include "marrow/toolbox/geometry/implant.hpp"
#include "marrow/toolbox/phantom/phantom.hpp"
#include "shipped.hpp"

namespace mirrored_patient {

using marrow::RigidTransform, marrow::phantom::Body, marrow::phantom::Bone, marrow::phantom::ClutteredPhantom,
    marrow::phantom::Fragment, marrow::phantom::Phantom;

/// Each check of a node, by the node's name. A check fails its test unless the node gives the mirrored answer.
using Checks = std::map<std::string, std::function<void()>>;
Checks checks_of_plans_and_robots();
Checks checks_of_simulations();

inline Eigen::Vector3d mirrored(const Eigen::Vector3d& point_mm) { return {-point_mm.x(), point_mm.y(), point_mm.z()}; }
/// A rotation vector keeps its part about the axis that changes its sign.
inline Eigen::Vector3d mirrored_turn(const Eigen::Vector3d& turn) { return {turn.x(), -turn.y(), -turn.z()}; }
inline std::vector<double> list_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline Eigen::Matrix3d mirrored(const Eigen::Matrix3d& rotation) {
  const Eigen::Vector3d sign(-1, 1, 1);
  return sign.asDiagonal() * rotation * sign.asDiagonal();
}
inline RigidTransform mirrored(RigidTransform transform) {
  transform.rotation = mirrored(transform.rotation);
  transform.translation_mm = mirrored(transform.translation_mm);
  return transform;
}
inline marrow::FragmentFrame mirrored(marrow::FragmentFrame frame) {
  frame.origin_mm = mirrored(frame.origin_mm);
  frame.axes = mirrored(frame.axes);
  return frame;
}
inline marrow::Pose mirrored(marrow::Pose pose) {
  pose.world_from_model = mirrored(pose.world_from_model);
  pose.frame = mirrored(pose.frame);
  if (pose.covariance) {
    const marrow::Vector6d sign = (marrow::Vector6d() << 1, -1, -1, -1, 1, 1).finished();
    pose.covariance = marrow::Matrix6d(sign.asDiagonal() * *pose.covariance * sign.asDiagonal());
  }
  return pose;
}
inline marrow::Mesh mirrored(marrow::Mesh mesh) {
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex = mirrored(vertex);
  for (auto& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}
/// The principal point is in the image's middle, so that the flipped image is that of the mirrored camera.
inline marrow::Camera mirrored(marrow::Camera camera) {
  camera.camera_from_world = mirrored(camera.camera_from_world);
  return camera;
}

inline marrow::geometry::Implant mirrored(marrow::geometry::Implant implant) {
  implant.surface = mirrored(implant.surface);
  for (auto& hole : implant.holes) hole.centre_mm = mirrored(hole.centre_mm), hole.axis = mirrored(hole.axis);
  return implant;
}
inline Bone mirrored(Bone bone) {
  bone.outer = mirrored(bone.outer);
  bone.inner = mirrored(bone.inner);
  bone.thigh_centre_mm.x() *= -1;
  return bone;
}
inline Fragment mirrored(Fragment fragment) {
  fragment.ct_from_bone = mirrored(fragment.ct_from_bone);
  fragment.world_from_ct = mirrored(fragment.world_from_ct);
  fragment.frame = mirrored(fragment.frame);
  for (Eigen::Vector3d& seed : fragment.seeds_mm) seed = mirrored(seed);
  fragment.outer = mirrored(fragment.outer);
  return fragment;
}
inline Phantom mirrored(Phantom phantom) {
  phantom.bone = mirrored(phantom.bone);
  phantom.fracture = mirrored(phantom.fracture);
  for (Fragment& fragment : phantom.fragments) fragment = mirrored(fragment);
  return phantom;
}
inline ClutteredPhantom mirrored(ClutteredPhantom phantom) {
  phantom.phantom = mirrored(phantom.phantom);
  for (auto* bodies : {&phantom.tissues, &phantom.bodies})
    for (Body& body : *bodies) {
      body.surface = mirrored(body.surface);
      body.ct_from_world = mirrored(body.ct_from_world);
    }
  return phantom;
}
template <class T>
marrow::List<T> mirrored(const marrow::List<T>& items) {
  marrow::List<T> all;
  for (std::size_t i = 0; i < items.size(); ++i) all.add(items.name(i), mirrored(items[i]));
  return all;
}

/// Whether a transform is the mirrored one of another.
inline void expect_mirrored(const RigidTransform& found, const RigidTransform& of, double most,
                            const std::string& what) {
  EXPECT_LT((found.rotation - mirrored(of).rotation).norm(), most) << what;
  EXPECT_LT((found.translation_mm - mirrored(of).translation_mm).norm(), most) << what;
}

// The patient: a left femur of few triangles, broken and displaced.
const Bone& left_femur();
/// Without relief, which is drawn and has no mirror image. `is_mirrored`: the mirrored motions of a mirrored bone.
shipped::Options fracture_options(bool is_mirrored);
const Phantom& left_fracture();
/// The whole leg, with the bones of the knee.
const ClutteredPhantom& left_leg();

}  // namespace mirrored_patient
