// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/rays.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace marrow::rays {

namespace {

/// Order of the pixels by tiles of the image, because neighbouring rays read the same memory.
std::vector<std::uint32_t> by_neighbourhood(const std::vector<Eigen::Vector2f>& pixels) {
  constexpr float kTile_px = 16;
  std::vector<std::pair<std::int64_t, std::uint32_t>> keys(pixels.size());
  for (std::uint32_t i = 0; i < pixels.size(); ++i) {
    const auto tile = [&](float x) { return std::int64_t(std::clamp(x / kTile_px, -1e6f, 1e6f)); };
    keys[i] = {tile(pixels[i].y()) * (std::int64_t(1) << 22) + tile(pixels[i].x()), i};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::uint32_t> order(pixels.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = keys[k].second;
  return order;
}

}  // namespace

Rays rays_of(const Camera& camera, const RigidTransform& world_from_model, const Grid& grid) {
  check_camera(camera, "the camera");
  const RigidTransform model_from_camera = inverse(world_from_model) * inverse(camera.camera_from_world);
  const Eigen::Matrix3d index_from_model = grid.spacing_mm.cwiseInverse().asDiagonal() * grid.direction.transpose();
  return {grid.index_from_point(model_from_camera.translation_mm),
          index_from_model * model_from_camera.rotation * camera.intrinsics.inverse(), grid.spacing_mm};
}

RayMotion::RayMotion(const Camera& camera, const RigidTransform& world_from_model, const Grid& grid,
                     const FragmentFrame& frame)
    : rays_(rays_of(camera, world_from_model, grid)) {
  const Eigen::Matrix3d model_from_index = grid.direction * grid.spacing_mm.asDiagonal();
  frame_from_direction_ = frame.axes.transpose() * model_from_index;
  frame_from_gradient_ = frame_from_direction_.inverse().transpose();
  const RigidTransform model_from_camera = inverse(world_from_model) * inverse(camera.camera_from_world);
  source_mm_ = frame.axes.transpose() * (model_from_camera.translation_mm - frame.origin_mm);
}

RayMotion::Change RayMotion::change(double value, const Eigen::Vector3d& by_source, const Eigen::Vector3d& by_direction,
                                    const Eigen::Vector3d& direction) const {
  // A motion of the model is the opposite motion of the ray.
  const Eigen::Vector3d force = frame_from_gradient_ * by_source, turning = frame_from_gradient_ * by_direction;
  Change change{value, {}};
  change.slopes << -source_mm_.cross(force) - (frame_from_direction_ * direction).cross(turning), -force;
  return change;
}

RayMotion::Change RayMotion::change(const SliceSums& sums, const SliceAxes& axes, int per_slice,
                                    const Eigen::Vector3d& direction) const {
  const double nearer = 1 / direction[axes.across], p = direction[axes.first] * nearer,
               q = direction[axes.second] * nearer;
  const Eigen::Vector3d& mm = rays_.spacing_mm;
  const double along_p = p * mm[axes.first], along_q = q * mm[axes.second], straight = mm[axes.across];
  // The path from one slice to the next, in mm.
  const double path = std::sqrt(along_p * along_p + along_q * along_q + straight * straight);
  const double thousandth = 1e-3 * per_slice, factor = thousandth * path;
  const double by_p = factor * sums.by_p + thousandth * along_p * mm[axes.first] / path * sums.sum,
               by_q = factor * sums.by_q + thousandth * along_q * mm[axes.second] / path * sums.sum;
  // The derivatives of the integral by the source and by the direction, in voxel indices.
  Eigen::Vector3d by_source, by_direction;
  by_source[axes.first] = factor * sums.by_first;
  by_source[axes.second] = factor * sums.by_second;
  by_source[axes.across] = -(p * by_source[axes.first] + q * by_source[axes.second]);
  by_direction[axes.first] = by_p * nearer;
  by_direction[axes.second] = by_q * nearer;
  by_direction[axes.across] = -(p * by_p + q * by_q) * nearer;
  return change(factor * sums.sum, by_source, by_direction, direction);
}

RadiographExpansion expansion_by_rays(const RayMotion& motion, const PixelGrid& grid,
                                      const std::function<RayMotion::Change(const Eigen::Vector3d&)>& change) {
  RadiographExpansion expansion;
  expansion.values.assign(grid.count(), 0.0f);
  for (auto& slopes : expansion.slopes) slopes.assign(grid.count(), 0.0f);
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d pixel = grid.pixel(column, row);
      const RayMotion::Change one = change(motion.rays().direction(pixel.x(), pixel.y()));
      const std::size_t i = std::size_t(row) * std::size_t(grid.columns) + std::size_t(column);
      expansion.values[i] = float(one.value);
      for (std::size_t k = 0; k < 6; ++k) expansion.slopes[k][i] = float(one.slopes[Eigen::Index(k)]);
    }
  });
  return expansion;
}

Span span_in_box(const std::array<int, 3>& first, const std::array<int, 3>& last, const Eigen::Vector3d& source,
                 const Eigen::Vector3d& direction, double margin) {
  Span span{0, std::numeric_limits<double>::infinity()};
  for (int k = 0; k < 3; ++k) {
    const double low = first[std::size_t(k)] - margin - source[k], high = last[std::size_t(k)] + margin - source[k];
    if (std::abs(direction[k]) < 1e-12) {
      if (low > 0 || high < 0) return {};
      continue;
    }
    const double a = low / direction[k], b = high / direction[k];
    span.from = std::max(span.from, std::min(a, b));
    span.to = std::min(span.to, std::max(a, b));
  }
  return span;
}

std::vector<float> RayProjector::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                            const PixelGrid& grid) const {
  const Rays rays = rays_of(camera, world_from_model, attenuation_.grid);
  std::vector<float> values(grid.count(), 0.0f);
  if (attenuation_.is_empty()) return values;
  tbb::parallel_for(0, grid.rows, [&](int row) {
    for (int column = 0; column < grid.columns; ++column) {
      const Eigen::Vector2d pixel = grid.pixel(column, row);
      values[std::size_t(row) * std::size_t(grid.columns) + std::size_t(column)] =
          integral(rays.source, rays.direction(pixel.x(), pixel.y()));
    }
  });
  return values;
}

std::vector<float> RayProjector::radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                            const std::vector<Eigen::Vector2f>& pixels) const {
  const Rays rays = rays_of(camera, world_from_model, attenuation_.grid);
  std::vector<float> values(pixels.size(), 0.0f);
  if (attenuation_.is_empty()) return values;
  const std::vector<std::uint32_t> order = by_neighbourhood(pixels);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pixels.size(), 64),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t k = range.begin(); k < range.end(); ++k) {
                        const Eigen::Vector2f& pixel = pixels[order[k]];
                        values[order[k]] = integral(rays.source, rays.direction(pixel.x(), pixel.y()));
                      }
                    });
  return values;
}

std::shared_ptr<const RadiographProjector> RayProjector::smoothed(double sigma_mm) const {
  constexpr std::size_t kMost = 4;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [of_kept_mm, kept] : kept_)
      if (of_kept_mm == sigma_mm) return kept;
  }
  std::shared_ptr<const RadiographProjector> made =
      of(rays::smoothed(attenuation_, sigma_mm));  // in parallel: unlocked
  const std::lock_guard lock(mutex_);
  kept_.emplace_back(sigma_mm, made);
  if (kept_.size() > kMost) kept_.pop_front();
  return made;
}

PixelGrid region_of(const Attenuation& attenuation, const Camera& camera, const RigidTransform& world_from_model) {
  check_camera(camera, "the camera");
  if (attenuation.is_empty()) return {};
  const PixelGrid whole{0, 0, 1, camera.width_px, camera.height_px};
  Eigen::Vector2d low(1e30, 1e30), high(-1e30, -1e30);
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d index;
    for (int k = 0; k < 3; ++k)
      index[k] = corner >> k & 1 ? attenuation.last[std::size_t(k)] + 1.0 : attenuation.first[std::size_t(k)] - 1.0;
    const Eigen::Vector2d pixel = project(camera, world_from_model * attenuation.grid.point_from_index(index));
    if (!pixel.allFinite()) return whole;  // part of the box lies behind the source
    low = low.cwiseMin(pixel);
    high = high.cwiseMax(pixel);
  }
  const int u = int(std::floor(std::clamp(low.x(), 0.0, double(camera.width_px)))),
            v = int(std::floor(std::clamp(low.y(), 0.0, double(camera.height_px))));
  const int right = int(std::ceil(std::clamp(high.x(), -1.0, camera.width_px - 1.0))),
            bottom = int(std::ceil(std::clamp(high.y(), -1.0, camera.height_px - 1.0)));
  if (right < u || bottom < v) return {};
  return {double(u), double(v), 1, right - u + 1, bottom - v + 1};
}

}  // namespace marrow::rays
