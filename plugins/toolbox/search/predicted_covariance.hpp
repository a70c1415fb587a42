// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <marrow/domain/functions.hpp>
#include <optional>
#include <string>
#include <vector>

namespace marrow::search {

/// Moves a pose in the units of the search: degrees about and millimetres along the fragment's axes.
RigidTransform moved_by_units(const RigidTransform& pose, const FragmentFrame& frame, const Vector6d& deg_and_mm);

/// The covariance of a minimum, predicted by the jackknife over blocks of the images (Efron and Tibshirani, An
/// Introduction to the Bootstrap, 1993, chapter 11; Shao and Tu, The Jackknife and Bootstrap, 1995). Without one block
/// the minimum would move by -H^-1 g, where g is the gradient of the change that the cost has without the block. The
/// covariance is the sum of the squares of these motions. So it follows the residuals' own noise, and their correlation
/// within a block.
///
/// H is the Hessian without the block. This matters where a block alone determines a direction: the residuals that are
/// left there are much smaller than its errors. The derivatives are the cost's own, if it has them. Otherwise they are
/// central differences along six directions. These are the axes first. If the cost is flat in a direction between them,
/// they are then the eigenvectors of the Hessian, with a longer step in this direction. A step is four to eight
/// standard deviations long: enough that the roughness of the cost does not matter. The mean over the blocks stands for
/// the whole cost there, so each pose is computed once.
///
/// Along the least certain direction, and for turns about the long axis, the cost may have other minima, or be
/// flatter than its curvature says. So the variance there becomes that of the density exp(-cost / noise) along the
/// line, if this is twice as large.
///
/// If only one or two blocks say anything, or the cost hardly changes along any axis, nothing is known: all deviations
/// are huge. No deviation is 0: if no block moves the minimum, all are the least step. The cost must have compared
/// something at the pose (nothing_compared()).
class PredictedCovariance {
 public:
  /// `coarser` is the same cost at a coarser level, if it is much cheaper there: where it says that the cost is far
  /// above that of the pose, the cost itself is not computed. It must outlive the constructor only.
  PredictedCovariance(const Cost& cost, const RigidTransform& pose, const FragmentFrame& frame,
                      const Cost* coarser = nullptr);

  /// Covariance of (r, t) in rad and mm, as in Pose. Absent if the cost has no blocks.
  const std::optional<Matrix6d>& covariance() const { return covariance_; }
  /// Whether the cost's own derivatives gave it.
  bool is_by_derivatives() const { return is_by_derivatives_; }
  int evaluations() const { return evaluations_; }
  /// The cost at the pose.
  double value() const { return value_; }
  /// Poses near other minima along these two lines whose cost is about that of the pose: two of each at most, the best
  /// first.
  const std::vector<RigidTransform>& other_minima() const { return other_minima_; }

  /// A sentence for each axis that the images hardly determine. If the axes are not anatomical, also for a direction of
  /// rotation between them.
  std::vector<std::string> warnings(double most_deg, double most_mm) const;

 private:
  static constexpr double kMostStep = 16;  ///< in degrees or mm

  RigidTransform pose_at(const Vector6d& motion) const { return moved_by_units(pose_, frame_, motion); }
  static bool is_regular(const Matrix6d& hessian);
  bool rests_on_few_blocks();
  bool close_again();
  void set_unknown();
  bool differentiate();
  bool rises_as_derivatives_say(const Matrix6d& hessian, const Matrix6d& covariance);
  void set_exact();
  void set_covariance(const Matrix6d& undetermined);
  void guess_steps();
  void choose_steps();
  std::vector<RigidTransform> diagonals() const;
  Matrix6d hessian_of(double value, const Vector6d& rises, const Eigen::VectorXd& at_diagonals) const;
  Matrix6d hessian(const Eigen::MatrixXd& at_diagonals) const;
  Matrix6d inverse(const Matrix6d& hessian, double flat) const;
  Eigen::VectorXd blocks_at(const RigidTransform& pose) const;
  Eigen::MatrixXd without_each_block(const std::vector<RigidTransform>& poses);
  Eigen::Matrix<double, Eigen::Dynamic, 6> gradients() const;
  void move_without_each_block(const Eigen::MatrixXd& at_diagonals, double flat);
  void turn_steps(const Matrix6d& hessian);
  void widen();
  void widen_along(const Vector6d& direction, double variance);
  void look_around();
  std::vector<RigidTransform> line(const Vector6d& direction, double step, int side) const;
  double variance_of_density(const std::vector<double>& values, double step) const;
  std::vector<double> values_along(const std::vector<RigidTransform>& poses);
  std::vector<std::size_t> worth_computing(const std::vector<RigidTransform>& poses) const;
  void find_other_minima(const std::vector<RigidTransform>& poses, const std::vector<double>& values);

  const Cost& cost_;
  const Cost* const coarser_;
  const RigidTransform pose_;
  const FragmentFrame& frame_;
  double value_ = 0;        ///< the cost at the pose
  double wanted_rise_ = 0;  ///< of the cost by a step; at first the standard deviation of its value
  double noise_ = 0;        ///< the rise of the cost that one standard deviation makes, times 2
  int evaluations_ = 0;
  Matrix6d steps_ = 0.5 * Matrix6d::Identity();  ///< a direction in each column, in degrees and mm
  Vector6d rises_;                               ///< mean rises at both ends of each step, of the mean without a block
  Eigen::VectorXd at_pose_;                      ///< the cost at the pose without each block
  std::array<Eigen::VectorXd, 12> at_ends_;      ///< the same at both ends of each step
  std::array<bool, 6> open_{};                   ///< directions in which the cost hardly changes
  Matrix6d in_units_;                            ///< the covariance in degrees and mm, without open directions
  std::optional<Matrix6d> covariance_;
  std::array<bool, 6> undetermined_{};  ///< axes
  bool has_few_blocks_ = false, is_by_derivatives_ = false;
  std::vector<RigidTransform> other_minima_;
};

}  // namespace marrow::search
