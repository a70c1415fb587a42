// SPDX-License-Identifier: Apache-2.0
// Nodes for starts for the tests of `marrow conformance`: a plain right one, and others that are wrong in one way each.
#include <marrow/plugin.hpp>

namespace {

using namespace marrow;

/// The rigid motion that brings the landmarks' points nearest to where they were tracked (Umeyama 1991).
Pose fitted(const Mesh& model, const Landmarks& landmarks, bool takes_all_for_right_bones = false) {
  check_mesh(model, "model");
  const auto count = Eigen::Index(landmarks.tracked.size());
  if (count < 3 || landmarks.points.size() != landmarks.tracked.size())
    throw Error("a start needs three tracked landmarks, each with its place in the CT");
  Eigen::Matrix3Xd from(3, count), to(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.col(i) = landmarks.points[std::size_t(i)].model_mm;
    to.col(i) = landmarks.tracked[std::size_t(i)].world_mm;
  }
  if (takes_all_for_right_bones) {
    from(0, 0) = std::abs(from(0, 0));
    from(0, 1) = -std::abs(from(0, 1));
  }
  if (!to.allFinite()) throw Error("a tracked landmark is not a number; leave it out");
  const Eigen::Matrix4d fit = Eigen::umeyama(from, to, false);
  Pose pose;
  pose.world_from_model = {"world", model.frame, fit.topLeftCorner<3, 3>(), fit.topRightCorner<3, 1>()};
  pose.frame = fragment_frame(model);
  return pose;
}

Pose plain(const Mesh& model, const Landmarks& landmarks) { return fitted(model, landmarks); }
Pose one_sided(const Mesh& model, const Landmarks& landmarks) { return fitted(model, landmarks, true); }
Pose aside(const Mesh& model, const Landmarks& landmarks) {
  Pose pose = fitted(model, landmarks);
  pose.world_from_model.translation_mm.x() += 15;
  return pose;
}
Pose without_axes(const Mesh& model, const Landmarks& landmarks) {
  Pose pose = fitted(model, landmarks);
  pose.frame = {};
  return pose;
}
/// Takes the bone's axes for those of the world, as they nearly are in most cases.
Pose upright(const Mesh& model, const Landmarks& landmarks) {
  Pose pose = fitted(model, landmarks);
  pose.world_from_model.rotation.setIdentity();
  return pose;
}

/// The start that it gets, whatever the cost says.
Pose trusting(const Mesh& model, const Cost&, const Optimizer&, const Pose& start) {
  check_mesh(model, "model");
  check_pose(start, "start");
  Pose pose = start;
  pose.frame = fragment_frame(model);
  return pose;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  const auto add = [&](const char* name, auto* function) {
    plugin.node(name, function)
        .summary("for a test")
        .in("model", "surface of the fragment")
        .in("landmarks", "landmarks")
        .out("pose", "pose to start from");
  };
  add("initial.plain", plain);
  add("initial.one_sided", one_sided);
  add("initial.aside", aside);
  add("initial.without_axes", without_axes);
  add("initial.upright", upright);
  plugin.node("initial.trusting", trusting)
      .summary("for a test")
      .in("model", "surface of the fragment")
      .in("cost", "cost of a pose")
      .in("optimizer", "minimiser")
      .in("start", "nominal placement")
      .out("pose", "pose to start from");
}
