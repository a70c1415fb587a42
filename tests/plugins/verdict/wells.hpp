// SPDX-License-Identifier: Apache-2.0
#pragma once
// A box, a cost with wells at given poses, and a pose to judge by them.
#include "tests/harness/node_test.hpp"

namespace marrow::test::wells {

inline Mesh box() { return test::box({0, 0, 0}, {30, 20, 100}); }

/// A cost with wells: in each view it is 1 - the deepest of depth * exp(-(distance / 10)^2), where the distance from a
/// well's pose counts a degree as a millimetre.
struct Wells : Cost {
  struct Well {
    RigidTransform pose;
    double depth;
  };
  std::vector<std::vector<Well>> views;
  FragmentFrame frame = fragment_frame(box());

  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    double least = 1;
    for (const Well& well : views[view]) {
      Vector6d motion = motion_between(well.pose, pose, frame);
      motion.head<3>() *= degrees(1);
      least = std::min(least, 1 - well.depth * std::exp(-motion.squaredNorm() / 100));
    }
    return least;
  }
  double value(const RigidTransform& pose) const override {
    double sum = 0;
    for (std::size_t i = 0; i < views.size(); ++i) sum += value_in_view(i, pose);
    return sum / double(views.size());
  }
  std::size_t view_count() const override { return views.size(); }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Wells>(*this); }
};

/// Looks along an axis of the world from 800 mm, with a detector behind it.
inline View view_along(const std::string& name, const Vector3d& turn_deg) {
  Camera camera = before_origin(pinhole(1000, 200, 200), 800);
  camera.camera_from_world.rotation = rotation_from_vector(radians(1) * turn_deg);
  return view_of(name, camera, cv::Mat(200, 200, CV_16UC1, cv::Scalar(1000)));
}

struct Trial {
  Wells cost, second;  ///< `second` is for a test to use
  Pose pose;
  Inputs inputs;
  List<View> views = views_named(view_along("frontal", {0, 0, 0}), view_along("lateral", {0, 90, 0}));

  Trial() {
    pose.world_from_model = placed({4, -3, 6}, {0.1, 0.3, -0.2});
    pose.frame = cost.frame;
    cost.views = {{{pose.world_from_model, 0.9}}, {{pose.world_from_model, 0.9}}};
    inputs = {{"pose", item(pose)},
              {"optimizer", call("optimizer.bobyqa", {}).at("optimizer")},
              {"views", each_view(views)},
              {"model", item(box())}};
  }
  RigidTransform moved_by(const std::array<double, 6>& deg_and_mm) const {
    Vector6d motion = Vector6d::Map(deg_and_mm.data());
    motion.head<3>() *= radians(1);
    return moved(pose.world_from_model, cost.frame, motion);
  }
  Pose pose_moved_by(const std::array<double, 6>& deg_and_mm) const {
    Pose moved = pose;
    moved.world_from_model = moved_by(deg_and_mm);
    return moved;
  }
  Verdict verdict(const Options& options = {}) {
    inputs["cost"] = Value::of<Cost>(std::make_shared<const Wells>(cost));
    return output<Verdict>("verdict.evidence", "verdict", inputs, options);
  }
};

inline double figure(const Verdict& verdict, const std::string& name) {
  for (const Metric& one : verdict.figures)
    if (one.name == name) return one.value;
  return std::nan("");
}

}  // namespace marrow::test::wells
