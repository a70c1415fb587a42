// SPDX-License-Identifier: Apache-2.0
#pragma once
// The rays of a view in the volume's voxel coordinates, and projectors that follow them one by one.
#include <mutex>

#include "marrow/project/attenuation.hpp"

namespace marrow::rays {

/// Rays of a camera in fractional voxel indices: point = source + t * (direction_from_pixel * (u, v, 1)).
struct Rays {
  Eigen::Vector3d source;
  Eigen::Matrix3d direction_from_pixel;
  Eigen::Vector3d spacing_mm;

  Eigen::Vector3d direction(double u, double v) const { return direction_from_pixel * Eigen::Vector3d(u, v, 1); }
};
/// The grid is in the model's frame. Throws Error if check_camera() refuses the camera or the frames do not match.
Rays rays_of(const Camera& camera, const RigidTransform& world_from_model, const Grid& grid);

/// A sum over the slices along a ray, and its derivatives: by the ray's slopes p and q, in voxels per slice, and by the
/// position of the source across the slices. p belongs to the axis `first`, q to `second`, both lie in the slices.
struct SliceSums {
  double sum = 0, by_p = 0, by_q = 0, by_first = 0, by_second = 0;
};
/// The axes of the grid along which SliceSums has its slopes, and the axis from slice to slice.
struct SliceAxes {
  int first = 0, second = 1, across = 2;
};

/// Turns derivatives of a ray's integral into those by a small motion of the model.
class RayMotion {
 public:
  /// The grid and the frame are in the model's frame. Throws Error as rays_of() does.
  RayMotion(const Camera& camera, const RigidTransform& world_from_model, const Grid& grid, const FragmentFrame& frame);
  const Rays& rays() const { return rays_; }
  /// Turns a gradient by voxel indices into one by mm along the frame's axes.
  const Eigen::Matrix3d& frame_from_gradient() const { return frame_from_gradient_; }
  /// Turns a direction in voxel indices into mm along the frame's axes.
  const Eigen::Matrix3d& frame_from_direction() const { return frame_from_direction_; }
  /// The source along the frame's axes, from its origin.
  const Eigen::Vector3d& source_mm() const { return source_mm_; }
  /// The integral along a ray in mm of water, and its derivatives by (r [rad], t [mm]).
  struct Change {
    double value = 0;
    Vector6d slopes = Vector6d::Zero();
  };
  /// From the derivatives by the source and by the direction, all in voxel indices.
  Change change(double value, const Eigen::Vector3d& by_source, const Eigen::Vector3d& by_direction,
                const Eigen::Vector3d& direction) const;
  /// From sums over every `per_slice`-th slice.
  Change change(const SliceSums& sums, const SliceAxes& axes, int per_slice, const Eigen::Vector3d& direction) const;

 private:
  const Rays rays_;
  Eigen::Matrix3d frame_from_gradient_, frame_from_direction_;
  Eigen::Vector3d source_mm_;
};

/// The part [from, to] of a ray, in multiples of its direction vector. Empty if from >= to.
struct Span {
  double from = 0, to = 0;
};
/// The part of a ray that lies in front of the source and inside the box of the voxels `first` to `last`, widened by
/// `margin` voxels. A margin of 1 includes all points that interpolation from these voxels reaches. `source` and
/// `direction` are in fractional voxel indices.
Span span_in_box(const std::array<int, 3>& first, const std::array<int, 3>& last, const Eigen::Vector3d& source,
                 const Eigen::Vector3d& direction, double margin);

/// The radiograph and its derivatives, ray by ray in several threads; `change` takes a ray's direction.
RadiographExpansion expansion_by_rays(const RayMotion& motion, const PixelGrid& grid,
                                      const std::function<RayMotion::Change(const Eigen::Vector3d&)>& change);

/// What RadiographProjector::region() gives for a model with this attenuation.
PixelGrid region_of(const Attenuation& attenuation, const Camera& camera, const RigidTransform& world_from_model);

/// A projector that integrates ray by ray, for many rays at once in several threads.
class RayProjector : public RadiographProjector {
 public:
  explicit RayProjector(Attenuation attenuation) : attenuation_(std::move(attenuation)) {}
  std::vector<float> radiograph(const Camera&, const RigidTransform& world_from_model, const PixelGrid&) const override;
  std::vector<float> radiograph(const Camera&, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override;
  PixelGrid region(const Camera& camera, const RigidTransform& world_from_model) const override {
    return region_of(attenuation_, camera, world_from_model);
  }
  /// The last few are kept, because each frame of a sequence asks for the same.
  std::shared_ptr<const RadiographProjector> smoothed(double sigma_mm) const override;

 protected:
  /// A projector of the same kind for another model; null, the default, if there is none.
  virtual std::shared_ptr<const RadiographProjector> of(Attenuation) const { return nullptr; }
  /// The line integral along a ray, in mm of water. Source and direction are in fractional voxel indices. Must be safe
  /// to call from several threads at once.
  virtual float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const = 0;
  const Attenuation attenuation_;

 private:
  mutable std::mutex mutex_;
  mutable std::deque<std::pair<double, std::shared_ptr<const RadiographProjector>>> kept_;  ///< by sigma_mm
};

/// The voxels that attenuate, in bricks of 4 x 4 x 4 voxels, with empty voxels around them. A ray of any direction
/// finds its next voxels in memory that it has just read. With voxels in rows and slices each step along the ray would
/// read distant memory. Safe to use from several threads at once.
class Bricks {
 public:
  explicit Bricks(const Attenuation& attenuation);

  /// The line integral along a ray in mm of water, by Joseph's method (IEEE Transactions on Medical Imaging 1982): the
  /// sum of the bilinear values in each slice across the ray's main axis, times the path from slice to slice. `source`
  /// and `direction` are in fractional voxel indices.
  float integral(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const;

  /// The same with its derivatives by a small motion of the model.
  RayMotion::Change change(const RayMotion& motion, const Eigen::Vector3d& direction) const;

 private:
  static constexpr int kBorder = 4;  ///< number of empty voxels around the box that may be read
  /// The slices that a ray crosses; none if begin > end.
  struct Path {
    SliceAxes axes;
    int begin = 0, end = -1;
  };
  Path path_of(const Eigen::Vector3d& source, const Eigen::Vector3d& direction) const;
  /// The place of voxel (x, y, z) in values_ is offsets(0)[x] + offsets(1)[y] + offsets(2)[z].
  const std::uint32_t* offsets(int axis) const {
    return offsets_[std::size_t(axis)].data() - begin_[std::size_t(axis)];
  }

  std::array<int, 3> first_, last_;    ///< box of the voxels that attenuate
  std::array<int, 3> begin_{0, 0, 0};  ///< the first voxel that has an offset, along each axis
  Eigen::Vector3d spacing_mm_;
  std::array<std::vector<std::uint32_t>, 3> offsets_;
  std::vector<std::int16_t, LargePages<std::int16_t>> values_;
};

}  // namespace marrow::rays
