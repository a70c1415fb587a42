// SPDX-License-Identifier: Apache-2.0
#include "scene.hpp"

#include "marrow/similarity/x_ray_view.hpp"

namespace marrow::conformance {

using namespace analytic;

namespace {

/// Half the squared distance from a pose along the six axes of `frame`, in units of 1 degree and 1 mm.
/// Alike at all levels.
class DistanceCost : public Cost {
 public:
  DistanceCost(RigidTransform middle, FragmentFrame frame) : middle_(std::move(middle)), frame_(std::move(frame)) {}

  double value(const RigidTransform& pose) const override { return 0.5 * units(pose).squaredNorm(); }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override {
    return std::make_shared<DistanceCost>(*this);
  }

  std::optional<Expansion> expansion(const RigidTransform& pose, const FragmentFrame& frame) const override {
    // By central differences of the six residuals: Gauss-Newton.
    constexpr double kStep = 1e-5;
    const Vector6d here = units(pose);
    Matrix6d change;
    for (int axis = 0; axis < 6; ++axis) {
      const Vector6d step = kStep * Vector6d::Unit(axis);
      change.col(axis) = (units(moved(pose, frame, step)) - units(moved(pose, frame, -step))) / (2 * kStep);
    }
    return Expansion{0.5 * here.squaredNorm(), change.transpose() * here, change.transpose() * change};
  }

 private:
  Vector6d units(const RigidTransform& pose) const {
    Vector6d motion = motion_between(middle_, pose, frame_);
    motion.head<3>() *= degrees(1);
    return motion;
  }

  RigidTransform middle_;
  FragmentFrame frame_;
};

constexpr double kPixel_mm = 0.8;
const Eigen::Vector3d kTurn_rad(0.2, -0.15, 0.3), kShift_mm(3, -2, 5);

View view_of(int index, const Scene& scene) {
  XRay x_ray{c_arm(index ? 80 : 0, kSize_px, kSize_px, kPixel_mm), scene.gain, scene.offset, scene.noise,
             std::uint32_t(index)};
  Body bodies = bone();
  if (scene.with_other)
    for (const Ellipsoid& one : other_bone()) bodies.push_back(one);
  return x_ray_view(x_ray, index ? "lateral" : "frontal", BodyProjector(bodies), truth());
}

/// The true pose, known to 1 degree and 1 mm.
Pose known_pose() {
  Pose pose;
  pose.world_from_model = truth();
  pose.frame = fragment_frame(mesh_of(bone()));
  pose.covariance = Matrix6d::Identity();
  pose.covariance->topLeftCorner<3, 3>() *= radians(1) * radians(1);
  return pose;
}

}  // namespace

RigidTransform truth() { return moved_by(kTurn_rad, kShift_mm); }

RigidTransform off_truth(const Eigen::Vector3d& turn_deg, const Eigen::Vector3d& shift_mm) {
  RigidTransform pose = truth();
  pose.rotation = rotation_from_vector(turn_deg * radians(1)) * pose.rotation;
  pose.translation_mm += shift_mm;
  return pose;
}
RigidTransform off_truth(int axis, double by) {
  const Eigen::Vector3d step = by * Eigen::Vector3d::Unit(axis % 3);
  return axis < 3 ? off_truth(step, {0, 0, 0}) : off_truth({0, 0, 0}, step);
}

Body bone() {
  const Eigen::Matrix3d tilt = rotation_from_vector({0.1, 0.05, 0.4});
  return {{{0, 0, 8}, {9, 13, 32}, tilt}, {{20, -5, -22}, {8, 10, 9}, tilt}, {{-17, 7, -25}, {6, 9, 8}, tilt}};
}
Body other_bone() { return {{{24, 6, 26}, {7, 6, 15}}}; }

std::shared_ptr<const BodyProjector> bone_projector() {
  static const auto kProjector = std::make_shared<const BodyProjector>(bone());
  return kProjector;
}

Inputs inputs_of(const Scene& scene, const std::function<void(View&, EdgeMap&)>& change) {
  List<View> views;
  List<EdgeMap> edges;
  for (int i = 0; i < 2; ++i) {
    View view = view_of(i, scene);
    EdgeMap map = edges_of(view);
    if (change) change(view, map);
    const std::string name = view.name;
    views.add(name, std::move(view));
    edges.add(name, std::move(map));
  }
  const Grid grid = grid_of({68, 56, 100}, {1, 1, 1});
  const auto field = std::make_shared<const SignedField>(field_of(bone(), grid, 6));
  List<SignedField> fields;
  fields.add_shared("bone", field);
  List<Pose> poses;
  poses.add("bone", known_pose());
  return {{"projector", Value::of<OutlineProjector>(bone_projector())},
          {"projector", Value::of<RadiographProjector>(bone_projector())},
          {"outline", Value::of<OutlineProjector>(bone_projector())},
          {"model", item(mesh_of(bone()))},
          {"volume", item(volume_of(bone(), grid, 700, 0))},
          {"field", Value::of<SignedField>(field)},
          {"other_bones", Value::of(fields, "fragment")},
          {"poses", Value::of(poses, "fragment")},
          {"views", Value::of(views, "view")},
          {"edges", Value::of(edges, "view")},
          {"cost", Value::of<Cost>(std::make_shared<const DistanceCost>(truth(), known_pose().frame))},
          {"prior", item(known_pose())},
          {"found", item(known_pose())}};
}

Made made(const Subject& subject, const Scene& scene) { return Made(subject, inputs_of(scene)); }

}  // namespace marrow::conformance
