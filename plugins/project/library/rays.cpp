// SPDX-License-Identifier: Apache-2.0
#include "marrow/project/rays.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>

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

namespace {

constexpr int kSide = 4;  ///< side of a brick in voxels, and number of slices that are handled at a time

// Four numbers that the compiler keeps in one register.
using Four = float __attribute__((vector_size(16)));
using FourIntegers = std::int32_t __attribute__((vector_size(16)));
using FourVoxels = std::int16_t __attribute__((vector_size(8)));

}  // namespace

Bricks::Bricks(const Attenuation& attenuation)
    : first_(attenuation.first), last_(attenuation.last), spacing_mm_(attenuation.grid.spacing_mm) {
  if (attenuation.is_empty()) return;
  std::uint32_t stride = kSide * kSide * kSide, within = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    begin_[k] = first_[k] - kBorder;
    const int bricks = (last_[k] + kBorder - begin_[k]) / kSide + 1;
    for (int i = 0; i < bricks * kSide; ++i)
      offsets_[k].push_back(std::uint32_t(i / kSide) * stride + std::uint32_t(i % kSide) * within);
    stride *= std::uint32_t(bricks);
    within *= kSide;
  }
  values_.assign(stride, 0);
  const std::uint32_t *x = offsets(0), *y = offsets(1), *z = offsets(2);
  tbb::parallel_for(first_[2], last_[2] + 1, [&](int k) {
    for (int j = first_[1]; j <= last_[1]; ++j) {
      const std::int16_t* row = attenuation.thousandths.data() + attenuation.grid.offset(0, j, k);
      for (int i = first_[0]; i <= last_[0]; ++i) values_[x[i] + y[j] + z[k]] = row[i];
    }
  });
}

Bricks::Path Bricks::path_of(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const {
  Path path;
  const Span span = span_in_box(first_, last_, source, direction, 1);
  if (!(span.from < span.to)) return path;
  int across = 0;
  direction.cwiseProduct(spacing_mm_).cwiseAbs().maxCoeff(&across);
  path.axes = {across == 0 ? 1 : 0, across == 2 ? 1 : 2, across};
  const double entry = source[across] + span.from * direction[across],
               exit = source[across] + span.to * direction[across];
  path.begin = std::max(int(std::ceil(std::min(entry, exit))), first_[std::size_t(across)]);
  path.end = std::min(int(std::floor(std::max(entry, exit))), last_[std::size_t(across)]);
  return path;
}

float Bricks::integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const {
  const auto [axes, begin, end] = path_of(source, direction);
  if (begin > end) return 0;
  const int a = axes.first, b = axes.second, across = axes.across;
  const Eigen::Vector3d slope = direction / direction[across];
  const std::uint32_t *slices = offsets(across), *columns = offsets(a), *rows = offsets(b);
  // From this origin all positions are positive, so that truncation rounds down.
  const int left = first_[std::size_t(a)] - 3, top = first_[std::size_t(b)] - 3;
  const float x = float(source[a] + slope[a] * (begin - source[across]) - left),
              y = float(source[b] + slope[b] * (begin - source[across]) - top);
  const float dx = float(slope[a]), dy = float(slope[b]);
  columns += left;
  rows += top;
  Four sum{0, 0, 0, 0};
  for (int first = begin; first <= end; first += kSide) {
    // The brick that the ray will enter soon, and its neighbour. Without this, half of the time is spent waiting for
    // memory.
    const int ahead = std::min(first + 4 * kSide, end), i_ahead = int(x + dx * float(ahead - begin)),
              j_ahead = int(y + dy * float(ahead - begin));
    __builtin_prefetch(values_.data() + slices[ahead] + rows[j_ahead] + columns[i_ahead]);
    __builtin_prefetch(values_.data() + slices[ahead] + rows[j_ahead + 1] + columns[i_ahead + 1]);
    // Positions of the ray in four slices.
    const float n = float(first - begin);
    const Four steps{n, n + 1, n + 2, n + 3}, px = x + dx * steps, py = y + dy * steps;
    const FourIntegers i = __builtin_convertvector(px, FourIntegers), j = __builtin_convertvector(py, FourIntegers);
    const Four u = px - __builtin_convertvector(i, Four), v = py - __builtin_convertvector(j, Four);
    const int count = std::min(kSide, end - first + 1);
    for (int k = 0; k < count; ++k) {
      const std::int16_t *near_row = values_.data() + slices[first + k] + rows[j[k]],
                         *far_row = values_.data() + slices[first + k] + rows[j[k] + 1];
      const std::uint32_t c = columns[i[k]], d = columns[i[k] + 1];
      const FourVoxels voxels{near_row[c], near_row[d], far_row[c], far_row[d]};
      const Four across_row{1 - u[k], u[k], 1 - u[k], u[k]}, across_rows{1 - v[k], 1 - v[k], v[k], v[k]};
      sum += across_row * across_rows * __builtin_convertvector(voxels, Four);
    }
  }
  return float(double(sum[0] + sum[1] + sum[2] + sum[3]) * slope.cwiseProduct(spacing_mm_).norm() * 1e-3);
}

RayMotion::Change Bricks::change(const RayMotion& motion, const Eigen::Vector3d& direction) const {
  const Eigen::Vector3d& source = motion.rays().source;
  const auto [axes, begin, end] = path_of(source, direction);
  const Eigen::Vector3d slope = direction / direction[axes.across];
  SliceSums sums;
  for (int slice = begin; slice <= end; ++slice) {
    const double depth = slice - source[axes.across], x = source[axes.first] + slope[axes.first] * depth,
                 y = source[axes.second] + slope[axes.second] * depth;
    const int i = int(std::floor(x)), j = int(std::floor(y));
    const double u = x - i, v = y - j;
    const std::int16_t* at = values_.data() + offsets(axes.across)[slice];
    const std::uint32_t *columns = offsets(axes.first) + i, *rows = offsets(axes.second) + j;
    const double a = at[rows[0] + columns[0]], b = at[rows[0] + columns[1]], c = at[rows[1] + columns[0]],
                 d = at[rows[1] + columns[1]];
    const double along = (1 - v) * (b - a) + v * (d - c), across = (1 - u) * (c - a) + u * (d - b);
    sums.sum += (1 - v) * (a + u * (b - a)) + v * (c + u * (d - c));
    sums.by_p += depth * along;
    sums.by_q += depth * across;
    sums.by_first += along;
    sums.by_second += across;
  }
  return motion.change(sums, axes, 1, direction);
}

}  // namespace marrow::rays
