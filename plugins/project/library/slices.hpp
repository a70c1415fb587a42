// SPDX-License-Identifier: Apache-2.0
#pragma once
// Computes a whole radiograph slice by slice, for all rays from one point. The factorisation of Lacroute and Levoy
// (SIGGRAPH 1994) turns Joseph's sums (IEEE Transactions on Medical Imaging 1982) into runs along rows of voxels.
#define TBB_PREVIEW_COLLABORATIVE_CALL_ONCE 1
#include <tbb/collaborative_call_once.h>

#include "marrow/project/rays.hpp"

namespace marrow::rays {

/// A volume laid out for sums over slices across each of its axes. Refers to `attenuation`, which must outlive it. Safe
/// to use from several threads at once.
class Slices {
 public:
  explicit Slices(const Attenuation& attenuation);

  /// The radiograph at a grid of pixels, in mm of water, row by row. std::nullopt if the directions of the rays differ
  /// too much or the source lies within the volume's slices. Such a view must be computed ray by ray (see Bricks).
  std::optional<std::vector<float>> radiograph(const Rays& rays, const PixelGrid& grid) const;

  /// The same with its derivatives by a small motion of the model.
  std::optional<RadiographExpansion> expansion(const RayMotion& motion, const PixelGrid& grid) const;

  /// The first and last voxel of a row that attenuate. None does if last < first.
  struct Extent {
    std::int16_t first = INT16_MAX, last = -1;
  };
  /// The volume as slices across one axis. A slice has `rows` rows of `length` voxels.
  struct Stack {
    std::array<int, 3> axes;  ///< axes of the grid: along a row, from slice to slice, from row to row
    const std::int16_t* values = nullptr;
    int length = 0, slices = 0, rows = 0;
    std::size_t slice_stride = 0, row_stride = 0;
    std::vector<Extent> extents;  ///< of each row, slice by slice
    int first_slice = 0, last_slice = -1, slice_step = 1;

    const Extent& extent(int slice, int row) const {
      return extents[std::size_t(slice) * std::size_t(rows) + std::size_t(row)];
    }
    const std::int16_t* row(int slice, int row) const {
      return values + std::size_t(slice) * slice_stride + std::size_t(row) * row_stride;
    }
  };

 private:
  /// The slices that the ray through the middle of a grid crosses best.
  const Stack& stack_for(const Rays& rays, const PixelGrid& grid) const;

  const Attenuation& attenuation_;
  std::vector<std::int16_t, LargePages<std::int16_t>> turned_;  ///< y fastest, then x, then z
  std::array<Stack, 3> stacks_;                                 ///< one for each axis from slice to slice
};

/// Sums of bilinear values over the slices that are perpendicular to the axis nearest to the ray's direction.
class JosephProjector : public RayProjector {
 public:
  explicit JosephProjector(Attenuation attenuation) : RayProjector(std::move(attenuation)), slices_(attenuation_) {}

  using RayProjector::radiograph;
  std::vector<float> radiograph(const Camera& camera, const RigidTransform& world_from_model,
                                const PixelGrid& grid) const override {
    const auto values = slices_.radiograph(rays_of(camera, world_from_model, attenuation_.grid), grid);
    return values ? *values : RayProjector::radiograph(camera, world_from_model, grid);
  }

  std::optional<RadiographExpansion> expansion(const Camera& camera, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid& grid) const override {
    const RayMotion motion(camera, world_from_model, attenuation_.grid, frame);
    if (auto expansion = slices_.expansion(motion, grid)) return expansion;
    return expansion_by_rays(motion, grid,
                             [&](const Eigen::Vector3d& direction) { return bricks().change(motion, direction); });
  }

 protected:
  std::shared_ptr<const RadiographProjector> of(Attenuation attenuation) const override {
    return std::make_shared<JosephProjector>(std::move(attenuation));
  }
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const override {
    return bricks().integral(source, direction);
  }

 private:
  /// Made for the first ray that needs them: whole images do without.
  const Bricks& bricks() const {
    tbb::collaborative_call_once(has_bricks_, [&] { bricks_.emplace(attenuation_); });
    return *bricks_;
  }

  const Slices slices_;
  mutable tbb::collaborative_once_flag has_bricks_;
  mutable std::optional<Bricks> bricks_;
};

}  // namespace marrow::rays
