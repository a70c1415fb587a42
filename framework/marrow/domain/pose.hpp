// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "marrow/domain/mesh.hpp"
#include "marrow/domain/transform.hpp"

namespace MARROW_EXPORT marrow {

/// Where a fragment is: `world_from_model` maps the model (CT frame) to the world. The covariance refers to a small
/// motion in `frame`: x_model' = o + R(axes * r) (x_model - o) + axes * t, applied before world_from_model. o is the
/// frame's origin, r the rotation [rad] about its axes, and t the translation [mm] along its axes.
struct Pose {
  RigidTransform world_from_model{"world", "ct"};
  FragmentFrame frame;
  /// Predicted covariance of (r, t) in rad and mm; absent if it was not predicted.
  std::optional<Matrix6d> covariance;
  /// In words: a direction that the images do not determine, a limit that was reached.
  std::vector<std::string> warnings;
  double cost = 0;
  int evaluations = 0;
  /// The least cost found after this many evaluations. All costs are those of the search's last level.
  struct Progress {
    int evaluations = 0;
    double cost = 0;
    using fields = Fields<&Progress::evaluations, &Progress::cost>;
  };
  std::vector<Progress> convergence;  ///< may be empty

  using fields = Fields<&Pose::world_from_model, &Pose::frame, &Pose::covariance, &Pose::warnings, &Pose::cost,
                        &Pose::evaluations, &Pose::convergence>;
};

/// Throws Error unless the covariance is symmetric and positive semidefinite, to 1e-9 of its deviations. Infinite and
/// NaN variances are allowed: they mean that a direction is unknown. `what` names the pose in the message.
void check_covariance(const Matrix6d& covariance, const std::string& what);
/// Throws Error if the transform is not rigid (check_rigid()), if the frame's axes are not a rotation, or if there is
/// a covariance that check_covariance() refuses. `what` names the pose in the message.
void check_pose(const Pose& pose, const std::string& what);

/// The pose after a small motion (r [rad], t [mm]) as defined at Pose.
RigidTransform moved(const RigidTransform& world_from_model, const FragmentFrame& frame, const Vector6d& motion);

/// The motion that leads from one pose to another. It is the inverse of moved(): to = moved(from, frame, motion).
Vector6d motion_between(const RigidTransform& from, const RigidTransform& to, const FragmentFrame& frame);

/// The matrix M that turns a small motion (r, t) in one frame into one in another: r' = to^T (from r), t' = to^T (from
/// t + (from r) x (to's origin - from's origin)). A covariance C becomes M C M^T.
Matrix6d change_of_frame(const FragmentFrame& from, const FragmentFrame& to);

/// The same pose, with its covariance in another frame.
Pose in_frame(Pose pose, const FragmentFrame& frame);

/// The exact pose of a fragment, known for simulated data. It has its own type because only nodes of some kinds may get
/// it, such as `evaluate` and `render`.
struct Truth {
  RigidTransform world_from_model{"world", "ct"};
  using fields = Fields<&Truth::world_from_model>;
};

/// One figure of merit with its unit ("deg", "mm", "px", "").
struct Metric {
  std::string name;
  double value = 0;
  std::string unit;
  using fields = Fields<&Metric::name, &Metric::value, &Metric::unit>;
};
struct Metrics {
  std::vector<Metric> items;
  using fields = Fields<&Metrics::items>;
};

}  // namespace marrow
