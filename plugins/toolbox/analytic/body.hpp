// SPDX-License-Identifier: Apache-2.0
#pragma once
// A body made of ellipsoids that do not touch. Its volume, field, surface, outline and radiograph are known
// analytically.
#include <vector>

#include "marrow/domain/functions.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::analytic {

/// Columns of `axes` are the directions of the three radii.
struct Ellipsoid {
  Eigen::Vector3d centre_mm, radii_mm;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};
using Body = std::vector<Ellipsoid>;

/// Length in mm of the part of a ray that is inside the body and in front of its start. `direction`: a unit vector.
double chord_mm(const Body& body, const Eigen::Vector3d& start_mm, const Eigen::Vector3d& direction);
/// Distance to the surface, negative inside, clamped to +-band_mm.
double signed_distance_mm(const Body& body, const Eigen::Vector3d& point_mm, double band_mm);

/// A grid in frame "ct" whose middle is the origin.
Grid grid_of(const std::array<int, 3>& size, const Eigen::Vector3d& spacing_mm,
             const Eigen::Matrix3d& direction = Eigen::Matrix3d::Identity());
/// `inside_hu` inside and `outside_hu` outside. A voxel at the surface is a mix, by the part of it that lies inside.
Volume volume_of(const Body& body, const Grid& grid, double inside_hu, double outside_hu);
/// The signed distance of each voxel, clamped to +-band_mm.
SignedField field_of(const Body& body, const Grid& grid, double band_mm);
/// A closed surface for each ellipsoid. Normals point outward.
Mesh mesh_of(const Body& body);

/// A C-arm's view: 1000 mm from the source to the detector, 600 mm from the source to the world's origin, turned about
/// the patient's long axis.
Camera c_arm(double angle_deg, int width_px, int height_px, double pixel_mm);
/// world_from_ct with this rotation vector and translation.
RigidTransform moved_by(const Eigen::Vector3d& turn_rad, const Eigen::Vector3d& shift_mm);

/// Draws the body exactly: the outer outline, and radiographs whose values are chord lengths in mm times a density.
class BodyProjector : public OutlineProjector, public RadiographProjector {
 public:
  explicit BodyProjector(Body body, double density = 1) : body_(std::move(body)), density_(density) {}
  std::vector<OutlinePoint> outline(const Camera&, const RigidTransform& world_from_model,
                                    double spacing_px) const override;
  std::vector<float> radiograph(const Camera&, const RigidTransform& world_from_model, const PixelGrid&) const override;
  std::vector<float> radiograph(const Camera&, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const override;
  /// By differences of chords half a micrometre apart. At the outline itself, where a chord begins like a square root,
  /// they are large.
  std::optional<RadiographExpansion> expansion(const Camera&, const RigidTransform& world_from_model,
                                               const FragmentFrame& frame, const PixelGrid&) const override;
  PixelGrid region(const Camera&, const RigidTransform& world_from_model) const override;

 private:
  /// The line integrals along the rays through these pixels.
  std::vector<double> integrals(const Camera&, const RigidTransform& world_from_model,
                                const std::vector<Eigen::Vector2f>& pixels) const;

  Body body_;
  double density_;
};

}  // namespace marrow::analytic
