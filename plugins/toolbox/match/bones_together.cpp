// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/match/bones_together.hpp"

#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

namespace marrow::match {
namespace {

bool is_same(const Camera& a, const Camera& b) {
  return a.width_px == b.width_px && a.height_px == b.height_px && a.intrinsics == b.intrinsics &&
         a.camera_from_world.rotation == b.camera_from_world.rotation &&
         a.camera_from_world.translation_mm == b.camera_from_world.translation_mm;
}

/// The smallest region of whole pixels that holds both.
PixelGrid united(const PixelGrid& a, const PixelGrid& b) {
  if (a.count() == 0) return b;
  if (b.count() == 0) return a;
  const double left = std::min(a.u_px, b.u_px), top = std::min(a.v_px, b.v_px),
               right = std::max(a.u_px + a.columns, b.u_px + b.columns),
               bottom = std::max(a.v_px + a.rows, b.v_px + b.rows);
  return {left, top, 1, int(right - left), int(bottom - top)};
}

void add(const std::vector<float>& more, std::vector<float>& values) {
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += more[i];
}

}  // namespace

std::vector<float> BonesTogether::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                             const PixelGrid& grid) const {
  std::vector<float> values = bone_->radiograph(camera, world_from_model, grid);
  if (others_.empty() || bone_->region(camera, world_from_model).count() == 0) return values;
  add_others(camera, grid, values);
  return values;
}

std::vector<float> BonesTogether::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                             const std::vector<Eigen::Vector2f>& pixels) const {
  std::vector<float> values = bone_->radiograph(camera, world_from_model, pixels);
  if (others_.empty() || bone_->region(camera, world_from_model).count() == 0) return values;
  for (const Other& other : others_) add(other.projector->radiograph(camera, other.world_from_model, pixels), values);
  return values;
}

std::optional<RadiographExpansion> BonesTogether::expansion(const Camera& camera,
                                                            const RigidTransform& world_from_model,
                                                            const FragmentFrame& frame, const PixelGrid& grid) const {
  auto expansion = bone_->expansion(camera, world_from_model, frame, grid);
  if (expansion && !others_.empty() && bone_->region(camera, world_from_model).count() > 0)
    add_others(camera, grid, expansion->values);
  return expansion;
}

PixelGrid BonesTogether::region(const Camera& camera, const RigidTransform& world_from_model) const {
  const PixelGrid own = bone_->region(camera, world_from_model);
  return own.count() == 0 ? own : united(own, region_of_others(camera));
}

BonesTogether::Projector BonesTogether::smoothed(double sigma_mm) const {
  return with_each([sigma_mm](const RadiographProjector& one) { return one.smoothed(sigma_mm); });
}

std::shared_ptr<const BonesTogether> BonesTogether::with_others(const List<RigidTransform>& world_from_others) const {
  std::vector<Other> others = others_;
  for (Other& other : others)
    if (const RigidTransform* pose = world_from_others.find(other.name)) other.world_from_model = *pose;
  return std::make_shared<BonesTogether>(bone_, std::move(others));
}

std::shared_ptr<const BonesTogether> BonesTogether::with_each(
    const std::function<Projector(const RadiographProjector&)>& change) const {
  const Projector bone = change(*bone_);
  if (!bone) return nullptr;
  std::vector<Other> others = others_;
  for (Other& other : others) {
    other.projector = change(*other.projector);
    if (!other.projector) return nullptr;
  }
  return std::make_shared<BonesTogether>(bone, std::move(others));
}

PixelGrid BonesTogether::region_of_others(const Camera& camera) const {
  PixelGrid region;
  for (const Other& other : others_) region = united(region, other.projector->region(camera, other.world_from_model));
  return region;
}

const BonesTogether::Raster& BonesTogether::raster(const Camera& camera, double step_px) const {
  const std::lock_guard lock(mutex_);
  for (const Raster& one : rasters_)
    if (one.grid.step_px == step_px && is_same(one.camera, camera)) return one;
  const PixelGrid region = region_of_others(camera);
  const double left = std::floor(region.u_px / step_px), top = std::floor(region.v_px / step_px),
               right = std::floor((region.u_px + region.columns - 1) / step_px),
               bottom = std::floor((region.v_px + region.rows - 1) / step_px);
  Raster raster{camera, {}, {}};
  raster.grid = {left * step_px, top * step_px, step_px, 0, 0};
  if (region.count() > 0) raster.grid.columns = int(right - left) + 1, raster.grid.rows = int(bottom - top) + 1;
  raster.values.assign(raster.grid.count(), 0.0f);
  // Isolated: a thread that waits for parts of this work must not start another radiograph, which needs the lock.
  tbb::this_task_arena::isolate([&] {
    for (const Other& other : others_)
      add(other.projector->radiograph(camera, other.world_from_model, raster.grid), raster.values);
  });
  return rasters_.emplace_back(std::move(raster));
}

void BonesTogether::add_others(const Camera& camera, const PixelGrid& grid, std::vector<float>& values) const {
  const double step = grid.step_px;
  if (!(step > 0) || std::fmod(grid.u_px, step) != 0 || std::fmod(grid.v_px, step) != 0) {
    for (const Other& other : others_) add(other.projector->radiograph(camera, other.world_from_model, grid), values);
    return;
  }
  const Raster& others = raster(camera, step);
  const int across = int(std::lround((others.grid.u_px - grid.u_px) / step)),
            down = int(std::lround((others.grid.v_px - grid.v_px) / step));
  for (int row = std::max(0, down); row < std::min(grid.rows, down + others.grid.rows); ++row)
    for (int column = std::max(0, across); column < std::min(grid.columns, across + others.grid.columns); ++column)
      values[std::size_t(row) * std::size_t(grid.columns) + std::size_t(column)] +=
          others.values[std::size_t(row - down) * std::size_t(others.grid.columns) + std::size_t(column - across)];
}

}  // namespace marrow::match
