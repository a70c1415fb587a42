// SPDX-License-Identifier: Apache-2.0
#pragma once
// Cameras, bones and costs for which the right result of refine.cameras can be computed by hand.
#include <marrow/domain/decompositions.hpp>

#include "marrow/toolbox/match/views_cost.hpp"
#include "tests/plugins/register/well.hpp"

namespace marrow::test::refine_cameras_test {

/// Two cameras of a C-arm at right angles, 600 mm from the origin of the world, with images of 64 blocks.
inline List<View> views(int count = 2) {
  List<View> views;
  for (int i = 0; i < count; ++i) {
    Camera camera = before_origin(pinhole(1700, 512, 512, {{256, 256}}), 600);
    camera.camera_from_world.rotation = rotation_from_vector(i * kPi / 2 * Vector3d::UnitY());
    const std::string name = i == 0 ? "frontal" : "lateral";
    views.add(name, view_of(name, camera, cv::Mat(512, 512, CV_16U, cv::Scalar(1000))));
  }
  return views;
}

/// Each view likes one pose best. By its blocks the cost is known as well as from `information` observations of noise
/// 1: its noise is 1 / information.
class Split : public Cost {
 public:
  Split(std::vector<RigidTransform> best, FragmentFrame frame, double information, double stiffness = 1)
      : best_(std::move(best)), frame_(frame), information_(information), stiffness_(stiffness) {}
  double value(const RigidTransform& pose) const override {
    double sum = 0;
    for (std::size_t v = 0; v < best_.size(); ++v) sum += value_in_view(v, pose) / double(best_.size());
    return sum;
  }
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override { return std::make_shared<Split>(*this); }
  std::size_t view_count() const override { return best_.size(); }
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    return 0.5 * stiffness_ * well::way(best_[view], pose, frame_).squaredNorm();
  }
  Numbers without_each_block(const RigidTransform& pose) const override {
    if (information_ == 0) return {};
    Numbers values;
    for (std::size_t v = 0; v < best_.size(); ++v)
      for (int block = 0; block < 64; ++block) {
        const double slope = block < 6 ? well::way(best_[v], pose, frame_)[block] : 0;
        values.push_back(value(pose) + std::sqrt(stiffness_ / information_) * slope / double(best_.size()));
      }
    return values;
  }

 private:
  std::vector<RigidTransform> best_;
  FragmentFrame frame_;
  double information_, stiffness_;
};

/// The same as a cost that is a mean over views.
class SplitInViews : public match::ViewsCost {
 public:
  explicit SplitInViews(std::shared_ptr<const Cost> cost) : ViewsCost(cost->view_count(), {}), cost_(cost) {}
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override {
    return std::make_shared<SplitInViews>(*this);
  }
  double value_in_view(std::size_t view, const RigidTransform& pose) const override {
    return cost_->value_in_view(view, pose);
  }
  ViewsCost::Split split(std::size_t view, const RigidTransform& pose) const override {
    const Numbers without = cost_->without_each_block(pose);
    const std::size_t count = without.size() / view_count();
    ViewsCost::Split split{value_in_view(view, pose), {}};
    for (std::size_t block = 0; block < count; ++block)
      split.without_block.push_back(split.value +
                                    double(view_count()) * (without[view * count + block] - cost_->value(pose)));
    return split;
  }

 private:
  std::shared_ptr<const Cost> cost_;
};

/// The same with derivatives, and without blocks of values.
class SplitWithDerivatives : public SplitInViews {
 public:
  explicit SplitWithDerivatives(std::shared_ptr<const Cost> cost) : SplitInViews(std::move(cost)) {}
  std::shared_ptr<const Cost> at_level(const CostLevel&) const override {
    return std::make_shared<SplitWithDerivatives>(*this);
  }
  ViewsCost::Split split(std::size_t view, const RigidTransform& pose) const override {
    return {value_in_view(view, pose), {}};
  }
  std::optional<ViewExpansion> expansion_in_view(std::size_t view, const RigidTransform& pose,
                                                 const FragmentFrame& frame) const override {
    constexpr double kStep = 1e-4;  // rad and mm
    const auto values = [&](const Vector6d& step) {
      const ViewsCost::Split split = SplitInViews::split(view, moved(pose, frame, step));
      Eigen::VectorXd all(1 + Eigen::Index(split.without_block.size()));
      all << split.value, Eigen::VectorXd::Map(split.without_block.data(), Eigen::Index(split.without_block.size()));
      return all;
    };
    const Eigen::VectorXd here = values(Vector6d::Zero());
    std::vector<Expansion> all(std::size_t(here.size()));
    for (int k = 0; k < 6; ++k) {
      const Eigen::VectorXd above = values(kStep * Vector6d::Unit(k)), below = values(-kStep * Vector6d::Unit(k));
      for (std::size_t i = 0; i < all.size(); ++i) {
        const auto at = Eigen::Index(i);
        all[i].value = here[at];
        all[i].gradient[k] = (above[at] - below[at]) / (2 * kStep);
        all[i].curvature(k, k) = (above[at] - 2 * here[at] + below[at]) / (kStep * kStep);
      }
    }
    return ViewExpansion{all[0], {all.begin() + 1, all.end()}};
  }
};

/// A bone 40 mm above the origin of the world, seen by each camera as if it had moved.
struct Bone {
  explicit Bone(const std::vector<RigidTransform>& motions, double information = 1e4, double at_mm = 40) {
    pose.frame.origin_mm = Vector3d(10, 0, 0);
    pose.world_from_model = placed({0, at_mm, 0}, {0.3, -0.2, 0.5});
    std::vector<RigidTransform> best;
    for (const RigidTransform& motion : motions) best.push_back(motion * pose.world_from_model);
    cost = std::make_shared<Split>(best, pose.frame, information);
  }
  Pose pose;
  std::shared_ptr<const Cost> cost;
};

inline RigidTransform motion(const Vector3d& rotation_deg, const Vector3d& shift_mm) {
  return {"world", "world", rotation_from_vector(radians(1) * rotation_deg), shift_mm};
}
const RigidTransform kNone = motion({0, 0, 0}, {0, 0, 0});

inline Inputs inputs(const std::vector<Bone>& bones, const List<View>& of = views()) {
  List<Cost> costs;
  List<Pose> poses;
  for (std::size_t i = 0; i < bones.size(); ++i) {
    costs.add_shared(i ? "proximal" : "distal", bones[i].cost);
    poses.add(i ? "proximal" : "distal", bones[i].pose);
  }
  return {{"views", each_view(of)},
          {"costs", shipped::list(costs, "fragment")},
          {"poses", shipped::list(poses, "fragment")}};
}

/// The motion of the world that the corrected camera of a view stands for.
inline RigidTransform found(const Outputs& outputs, std::size_t view) {
  return inverse(views()[view].camera.camera_from_world) *
         outputs.at("views").as_list<View>()[view].camera.camera_from_world;
}
inline Metrics motions(const Outputs& outputs, std::size_t view) {
  return outputs.at("motions").as_list<Metrics>()[view];
}
inline double figure(const Metrics& metrics, const std::string& name) { return shipped::figure(item(metrics), name); }

}  // namespace marrow::test::refine_cameras_test
