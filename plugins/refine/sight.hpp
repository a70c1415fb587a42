// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "bone_in_view.hpp"

#include "marrow/toolbox/geometry/camera_deviations.hpp"

namespace marrow::refine {

/// Root mean square errors that are expected of a calibration, where nothing else is stated about a camera.
struct ExpectedErrors {
  double turn_deg = 0.5;
  double shift_mm = 1;
  double focal_percent = 1;
  double centre_px = 5;
};

/// A camera's motion: rotations [deg] about the axes u, v and depth of its image, through `centre_mm`, and shifts [mm]
/// along them.
struct Sight {
  Eigen::Vector3d centre_mm;
  Eigen::Matrix3d axes;  ///< u, v and depth in columns, in the world
  Matrix6d covariance;   ///< expected of the six numbers
  geometry::CameraParameters parameter_deviations;
  Eigen::Matrix<double, 6, geometry::kCameraParameters> by_parameters;

  Vector6d deviation() const { return covariance.diagonal().cwiseSqrt(); }
  /// From now on hardly anything is expected of this camera: a thousandth of what was.
  void count_as_right() {
    covariance *= 1e-6;
    parameter_deviations *= 1e-3;
  }

  RigidTransform motion(const Vector6d& deg_and_mm) const {
    const Vector6d motion = from_units(deg_and_mm);
    RigidTransform moved{"world", "world"};
    moved.rotation = rotation_from_vector(axes * motion.head<3>());
    moved.translation_mm = centre_mm - moved.rotation * centre_mm + axes * motion.tail<3>();
    return moved;
  }
  /// The inverse of motion().
  Vector6d numbers(const RigidTransform& motion) const {
    Vector6d numbers;
    numbers << axes.transpose() * vector_from_rotation(motion.rotation) * degrees(1),
        axes.transpose() * (motion.translation_mm - centre_mm + motion.rotation * centre_mm);
    return numbers;
  }
  /// The motion of the whole world by six numbers about and along its own axes.
  RigidTransform shared_motion(const Vector6d& deg_and_mm) const {
    return Sight{centre_mm, Eigen::Matrix3d::Identity(), covariance, parameter_deviations, by_parameters}.motion(
        deg_and_mm);
  }
  /// How a bone's pose moves along its own axes, for small motions of the camera; both in degrees and mm.
  Matrix6d of_bone(const RigidTransform& world_from_model, const FragmentFrame& frame) const {
    const Eigen::Matrix3d to_bone = (world_from_model.rotation * frame.axes).transpose();
    const Eigen::Vector3d arm = world_from_model * frame.origin_mm - centre_mm;
    Matrix6d change = Matrix6d::Zero();
    change.topLeftCorner<3, 3>() = change.bottomRightCorner<3, 3>() = to_bone * axes;
    for (int i = 0; i < 3; ++i) change.block<3, 1>(3, i) = to_bone * axes.col(i).cross(arm) * radians(1);
    return change;
  }
};

/// What is expected of a view's camera, as motions about a point between the bones: what is stated about this camera,
/// and the expected errors for the rest. Throws Error if that point does not lie in front of the camera.
inline Sight sight_of(const View& view, const Eigen::Vector3d& centre_mm, const ExpectedErrors& expected,
                      geometry::CameraDeviations stated = {}) {
  // No device is better known than this. It keeps the covariance regular.
  constexpr double kLeastTurn_deg = 1e-3, kLeastShift_mm = 1e-3;
  // A motion shows an error of the principal point or of the focal length up to a tenth of itself.
  constexpr double kApproximate = 0.1;
  if (!((view.camera.camera_from_world * centre_mm).z() > 0))
    throw Error("view '" + view.name + "': the bones do not lie in front of its camera; look at the overlays first");
  stated.focal_percent = stated.focal_percent.value_or(expected.focal_percent);
  stated.centre_px = stated.centre_px.value_or(expected.centre_px);
  const double of_ray = *stated.centre_px / view.camera.intrinsics(0, 0);
  stated.turn_deg =
      std::hypot(stated.turn_deg.value_or(expected.turn_deg), kLeastTurn_deg, kApproximate * degrees(of_ray));
  stated.shift_mm = std::hypot(stated.shift_mm.value_or(expected.shift_mm), kLeastShift_mm,
                               kApproximate * of_ray * (view.camera.camera_from_world * centre_mm).z());
  Sight sight{centre_mm, view.camera.camera_from_world.rotation.transpose(), Matrix6d(),
              geometry::deviations_of(stated), geometry::motion_by_parameters(view.camera, centre_mm)};
  const Eigen::MatrixXd root = sight.by_parameters * sight.parameter_deviations.asDiagonal();
  sight.covariance = root * root.transpose();
  return sight;
}

/// What is expected of the cameras' motions: a Gaussian density. A motion that all cameras share changes no image,
/// because the bones can follow it. So the images cannot tell how large it is, and it always counts as expected. The
/// images only tell the scale of the rest: how far the cameras are off relative to each other.
class CameraPrior {
 public:
  explicit CameraPrior(const std::vector<Sight>& sights) {
    const Eigen::Index n = 6 * Eigen::Index(sights.size());
    Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(n, n);
    Eigen::MatrixXd of_shared = Eigen::MatrixXd::Zero(n, 6);  // each camera's motion, for one of the whole world
    for (std::size_t v = 0; v < sights.size(); ++v) {
      const Eigen::Index m = 6 * Eigen::Index(v);
      weight.block<6, 6>(m, m) = inverse_of_symmetric(sights[v].covariance);
      of_shared.block<3, 3>(m, 0) = of_shared.block<3, 3>(m + 3, 3) = sights[v].axes.transpose();
    }
    // The shared motion is the mean of all motions, weighed by their inverse covariances. What is left of each motion
    // does not correlate with it.
    const Eigen::MatrixXd weighted = weight * of_shared;
    const Matrix6d normal = of_shared.transpose() * weighted;
    mean_ = inverse_of_symmetric(normal) * weighted.transpose();
    const Eigen::MatrixXd shared_part = of_shared * mean_, rest = Eigen::MatrixXd::Identity(n, n) - shared_part;
    shared_ = shared_part.transpose() * weight * shared_part;
    rest_ = rest.transpose() * weight * rest;
  }

  /// The inverse covariance of all motions, if the cameras are off relative to each other by `scale` times what is
  /// expected.
  Eigen::MatrixXd inverse_covariance(double scale) const { return shared_ + rest_ / (scale * scale); }
  /// The motion of the whole world that is most probable with these motions, about and along its axes.
  Vector6d shared_motion(const Eigen::VectorXd& all_motions) const { return mean_ * all_motions; }
  /// The logarithm of the density's factor that depends on the scale.
  double log_factor(double scale) const { return -double(shared_.rows() - 6) * std::log(scale); }

 private:
  Eigen::MatrixXd mean_, shared_, rest_;
};

/// A matrix F with F F^T = a^-1, for a symmetric and positive definite matrix. J F F^T J^T is then the covariance of J
/// x for any J, and never indefinite, however much cancels. The numbers may differ much in size, so they are scaled
/// first.
inline Eigen::MatrixXd root_of_inverse(Eigen::MatrixXd a) {
  a.diagonal().array() += 1e-9;  // for a direction that nothing determines
  const Eigen::VectorXd scale = a.diagonal().cwiseSqrt().cwiseInverse();
  const auto eigen = eigen_of_symmetric<Eigen::Dynamic>(scale.asDiagonal() * a * scale.asDiagonal());
  return scale.asDiagonal() * eigen.vectors * eigen.values.cwiseSqrt().cwiseInverse().asDiagonal();
}

}  // namespace marrow::refine
