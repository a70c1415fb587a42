// SPDX-License-Identifier: Apache-2.0
// Smoothing a model for each pose would take too long. So it is smoothed by a few variances, each twice the one before.
// A radiograph is a mixture of the radiographs for the two variances next to the wanted one, in such a proportion that
// it has the wanted variance. The mixture changes continuously with the pose, so a cost does not jump.
#include "smoothed_at_bone.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>

namespace marrow::match {
namespace {

constexpr double kLeast = 1e-3, kMost = 0.125;  // limits of the standard deviation, in half sizes of the model

/// A box that contains all of a model that is seen, in the model's frame.
struct Box {
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero(), half_mm = Eigen::Vector3d::Zero();
};

/// The pixels that show a model from very far away, along the axis `away` of its own frame; `box` fills the image.
PixelGrid seen_from_afar(const RadiographProjector& projector, const Box& box, int away, Camera& camera) {
  constexpr int kSide_px = 65536;
  const double half_mm = box.half_mm.maxCoeff(), distance_mm = 1e6 * half_mm;
  camera.width_px = camera.height_px = kSide_px;
  const double focal_px = 0.5 * kSide_px / half_mm * distance_mm, centre_px = 0.5 * (kSide_px - 1);
  camera.intrinsics << focal_px, 0, centre_px, 0, focal_px, centre_px, 0, 0, 1;
  Eigen::Matrix3d& axes = camera.camera_from_world.rotation;
  for (int k = 0; k < 3; ++k) axes.row(k) = Eigen::Vector3d::Unit((away + 1 + k) % 3).transpose();
  camera.camera_from_world.translation_mm = Eigen::Vector3d(0, 0, distance_mm) - axes * box.middle_mm;
  return projector.region(camera, RigidTransform{"world", "ct"});
}

/// The box of a model, to a ten thousandth of its size: first within 20 m, then within what was found.
std::optional<Box> box_of(const RadiographProjector& projector) {
  constexpr double kFarthest_mm = 1e4, kMargin = 1.2;
  Box box{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kFarthest_mm)};
  for (int round = 0; round < 2; ++round) {
    Box found = box;
    for (const int away : {0, 1}) {
      Camera camera;
      const PixelGrid seen = seen_from_afar(projector, box, away, camera);
      if (seen.count() == 0) return std::nullopt;
      const double mm = 2 * box.half_mm.maxCoeff() / camera.width_px;
      const double width_px = seen.columns - 1, height_px = seen.rows - 1;
      const int u = (away + 1) % 3, v = (away + 2) % 3;
      found.middle_mm[u] = box.middle_mm[u] + mm * (seen.u_px + 0.5 * width_px - camera.intrinsics(0, 2));
      found.middle_mm[v] = box.middle_mm[v] + mm * (seen.v_px + 0.5 * height_px - camera.intrinsics(1, 2));
      found.half_mm[u] = 0.5 * mm * (width_px + 1);
      found.half_mm[v] = 0.5 * mm * (height_px + 1);
    }
    box = found;
    if (round == 0) box.half_mm *= kMargin;
  }
  return box;
}

class SmoothedAtBone : public RadiographProjector {
 public:
  SmoothedAtBone(const RadiographProjector& projector, double sigma_px, const Box& box)
      : projector_(projector), sigma_px_(sigma_px), box_(box) {}

  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    return mixed(camera, world_from_model, grid);
  }
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override {
    return mixed(camera, world_from_model, pixels);
  }
  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    const Mixture mixture = mixture_at(camera, world_from_model);
    auto sharper = at(mixture.level).expansion(camera, world_from_model, frame, grid),
         smoother = at(mixture.level + 1).expansion(camera, world_from_model, frame, grid);
    if (!sharper || !smoother) return std::nullopt;
    for (int k = 0; k < 6; ++k) {
      // By differences, because it is a number and costs no radiograph.
      constexpr double kStep = 1e-4;
      const auto variance = [&](double step) {
        return variance_at(camera, moved(world_from_model, frame, step * Vector6d::Unit(k)));
      };
      const auto change = float((variance(kStep) - variance(-kStep)) / (2 * kStep) / std::exp2(mixture.level));
      std::vector<float>&slopes = sharper->slopes[std::size_t(k)], &others = smoother->slopes[std::size_t(k)];
      for (std::size_t i = 0; i < slopes.size(); ++i)
        slopes[i] += mixture.share * (others[i] - slopes[i]) + change * (smoother->values[i] - sharper->values[i]);
    }
    for (std::size_t i = 0; i < sharper->values.size(); ++i)
      sharper->values[i] += mixture.share * (smoother->values[i] - sharper->values[i]);
    return sharper;
  }
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    const PixelGrid sharp = projector_.region(camera, world_from_model);
    if (sharp.count() == 0) return sharp;
    const double margin_px = std::ceil(3 * sigma_px_);
    const double left = std::max(0.0, sharp.u_px - margin_px), top = std::max(0.0, sharp.v_px - margin_px),
                 right = std::min(camera.width_px - 1.0, sharp.u_px + sharp.columns - 1 + margin_px),
                 bottom = std::min(camera.height_px - 1.0, sharp.v_px + sharp.rows - 1 + margin_px);
    return {left, top, 1, int(right - left) + 1, int(bottom - top) + 1};
  }

 private:
  /// The projector smoothed by the variance 2^level mm^2.
  const RadiographProjector& at(int level) const {
    const std::lock_guard lock(mutex_);
    auto& one = levels_[level];
    // Isolated: a thread that waits for parts of this work must not start another radiograph, which needs the lock.
    if (!one) tbb::this_task_arena::isolate([&] { one = projector_.smoothed(std::exp2(0.5 * level)); });
    return *one;
  }

  /// The share of the radiograph for the variance 2^(level + 1) mm^2; the rest is that for 2^level mm^2.
  struct Mixture {
    int level = 0;
    float share = 0;
  };
  Mixture mixture_at(const Camera& camera, const RigidTransform& world_from_model) const {
    const double variance_mm2 = variance_at(camera, world_from_model);
    const int level = int(std::floor(std::log2(variance_mm2)));
    return {level, float(variance_mm2 / std::exp2(level) - 1)};
  }

  template <class Pixels>
  std::vector<float> mixed(const Camera& camera, const RigidTransform& world_from_model, const Pixels& pixels) const {
    const auto [level, share] = mixture_at(camera, world_from_model);
    std::vector<float> values = at(level).radiograph(camera, world_from_model, pixels);
    if (!(share > 0)) return values;
    const std::vector<float> smoother = at(level + 1).radiograph(camera, world_from_model, pixels);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] += share * (smoother[i] - values[i]);
    return values;
  }

  /// The variance of the image's blur at the model. Limited, so that a search far away needs no endless memory.
  double variance_at(const Camera& camera, const RigidTransform& world_from_model) const {
    const double sigma_mm = sigma_px_ * pixel_size_at_mm(camera, world_from_model * box_.middle_mm),
                 size_mm = box_.half_mm.maxCoeff();
    return std::pow(std::clamp(sigma_mm, kLeast * size_mm, kMost * size_mm), 2);
  }

  const RadiographProjector& projector_;
  const double sigma_px_;
  const Box box_;
  mutable std::mutex mutex_;
  mutable std::map<int, std::shared_ptr<const RadiographProjector>> levels_;
};

}  // namespace

std::shared_ptr<const RadiographProjector> smoothed_at_bone(const RadiographProjector& projector, double sigma_px) {
  const std::optional<Box> box = box_of(projector);
  if (!box || !projector.smoothed(kLeast * box->half_mm.maxCoeff())) return nullptr;
  return std::make_shared<SmoothedAtBone>(projector, sigma_px, *box);
}

}  // namespace marrow::match
