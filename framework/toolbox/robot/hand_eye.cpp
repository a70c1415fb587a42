// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robot/hand_eye.hpp"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "least_squares.hpp"
#include "marrow/domain/decompositions.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::robot {
namespace {

/// X after a turn [rad] about `centre_mm` and a shift, both along the axes of the frame "reference".
RigidTransform changed(const RigidTransform& x, const Eigen::Vector3d& centre_mm, const Eigen::VectorXd& by) {
  FragmentFrame frame;
  frame.origin_mm = centre_mm;
  frame.axes.setIdentity();
  return moved(x, frame, by);
}

/// The difference between a motion as seen and as X predicts it, in standard deviations.
Vector6d difference(const Move& move, const RigidTransform& x, const HandEyeNoise& noise) {
  const RigidTransform predicted = inverse(x) * move.told * x;
  const double turn = vector_from_rotation(move.seen.rotation).norm(),
               shift = (move.seen * move.centre_mm - move.centre_mm).norm();
  Vector6d result;
  result.head<3>() = vector_from_rotation(move.seen.rotation * predicted.rotation.transpose()) /
                     std::hypot(radians(noise.rotation_deg), noise.part * turn);
  result.tail<3>() =
      (move.seen * move.centre_mm - predicted * move.centre_mm) / std::hypot(noise.shift_mm, noise.part * shift);
  return result;
}

/// The residual times sqrt(rho(s) / s) with Cauchy's rho(s) = c log(1 + s / c): least squares then minimise sum rho.
Vector6d robust(const Vector6d& residual) {
  constexpr double kUsual = 38;  // squared length that one good move in a million exceeds (chi-squared, 6)
  const double squares = residual.squaredNorm();
  return squares < 1e-12 ? residual : Vector6d(residual * std::sqrt(kUsual * std::log1p(squares / kUsual) / squares));
}

/// The 24 rotations of a cube, the identity first: they are spread evenly over all rotations.
std::vector<Eigen::Matrix3d> turns_of_a_cube() {
  std::vector<Eigen::Matrix3d> turns;
  for (int x = 0; x < 6; ++x)
    for (int y = 0; y < 6; ++y) {
      if (x / 2 == y / 2) continue;
      Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
      turn(x / 2, 0) = x % 2 ? -1 : 1;
      turn(y / 2, 1) = y % 2 ? -1 : 1;
      turn.col(2) = turn.col(0).cross(turn.col(1));
      turns.push_back(turn);
    }
  return turns;
}

/// The smallest eigenvalue's share says whether the axes differ: sine squared of the angle that they spread over.
void check_axes(const std::vector<Eigen::Vector3d>& turns_rad, const std::string& what) {
  constexpr double kLeastSine = 0.17;  // 10 degrees
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& turn : turns_rad)
    if (turn.norm() > 1e-6) spread += turn.normalized() * turn.normalized().transpose();
  const Eigen::Vector3d values = eigen_of_symmetric<3>(spread).values;
  if (!(values[1] > kLeastSine * kLeastSine * 0.5 * values.sum()))
    throw Error(what + " turn about one axis only; give motions whose axes are at least 30 degrees apart");
}

Eigen::Matrix3d minus_identity(const Eigen::Matrix3d& rotation) { return rotation - Eigen::Matrix3d::Identity(); }

/// The vector with the least |matrix x - right|.
Eigen::VectorXd least(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right) {
  return solve_symmetric<Eigen::Dynamic>(matrix.transpose() * matrix, matrix.transpose() * right);
}

}  // namespace

HandEye estimate_hand_eye(const std::vector<Move>& moves, const RigidTransform& guess, const HandEyeNoise& noise) {
  check_rigid(guess, "the guess of the hand-eye transform");
  const Eigen::Vector3d centre = moves.empty() ? Eigen::Vector3d::Zero() : moves.back().centre_mm;
  const auto residuals_at = [&](const RigidTransform& x) {
    Eigen::VectorXd all(6 * Eigen::Index(moves.size() + 1));
    const RigidTransform off = inverse(guess) * x;
    all.head<3>() = vector_from_rotation(off.rotation) / radians(noise.guess_deg);
    all.segment<3>(3) = (off * centre - centre) / noise.guess_mm;
    for (std::size_t i = 0; i < moves.size(); ++i)
      all.segment<6>(6 * Eigen::Index(i + 1)) = robust(difference(moves[i], x, noise));
    return all;
  };
  Vector6d step;
  step << Eigen::Vector3d::Constant(1e-5), Eigen::Vector3d::Constant(1e-3);
  const auto least_from = [&](const RigidTransform& start, int most_rounds) {
    return least_squares([&](const Eigen::VectorXd& change) { return residuals_at(changed(start, centre, change)); },
                         step, most_rounds);
  };
  HandEye best{guess, Matrix6d::Identity()};
  double least_sum = 0;
  for (const Eigen::Matrix3d& turn : turns_of_a_cube()) {
    Eigen::VectorXd by = Eigen::VectorXd::Zero(6);
    by.head<3>() = vector_from_rotation(turn);
    const RigidTransform start = changed(guess, centre, by);
    const LeastSquares found = least_from(start, 40);
    const bool is_first = by.isZero();
    if (!is_first && found.sum >= least_sum) continue;
    least_sum = found.sum;
    best.robot_from_reference = changed(start, centre, found.change);
    if (moves.empty()) break;
  }
  best.covariance = inverse_of_symmetric(least_from(best.robot_from_reference, 1).hessian);
  return best;
}

RigidTransform solve_ax_xb(const std::vector<Move>& moves) {
  if (moves.size() < 2)
    throw Error("the hand-eye transform needs 2 motions or more; there are " + std::to_string(moves.size()));
  std::vector<Eigen::Vector3d> turns;
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero();
  for (const Move& move : moves) {
    turns.push_back(vector_from_rotation(move.told.rotation));
    products += turns.back() * vector_from_rotation(move.seen.rotation).transpose();
  }
  check_axes(turns, "the motions of the hand-eye transform");
  RigidTransform x{moves[0].told.source, moves[0].seen.source, nearest_rotation(products), Eigen::Vector3d::Zero()};
  Eigen::MatrixXd matrix(3 * Eigen::Index(moves.size()), 3);
  Eigen::VectorXd right(matrix.rows());
  for (std::size_t i = 0; i < moves.size(); ++i) {
    matrix.middleRows<3>(3 * Eigen::Index(i)) = minus_identity(moves[i].told.rotation);
    right.segment<3>(3 * Eigen::Index(i)) = x.rotation * moves[i].seen.translation_mm - moves[i].told.translation_mm;
  }
  x.translation_mm = least(matrix, right);
  return x;
}

RobotWorld solve_ax_zb(const std::vector<Station>& stations) {
  const Eigen::Index count = Eigen::Index(stations.size());
  if (count < 3)
    throw Error("the robot's place needs 3 stations or more; there are " + std::to_string(stations.size()));
  std::vector<Eigen::Vector3d> turns;
  for (const Station& station : stations)
    turns.push_back(
        vector_from_rotation(stations[0].base_from_hand.rotation.transpose() * station.base_from_hand.rotation));
  check_axes(turns, "the stations of the robot");
  // sum kron(R_B, R_A) vec(R_X) = n vec(R_Z): the singular vectors of the largest singular value.
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(9, 9);
  for (const Station& station : stations)
    for (int row = 0; row < 3; ++row)
      for (int column = 0; column < 3; ++column)
        sum.block<3, 3>(3 * row, 3 * column) +=
            station.world_from_target.rotation(row, column) * station.base_from_hand.rotation;
  const Eigen::MatrixXd squares = sum.transpose() * sum;
  const Eigen::VectorXd of_x = eigen_of_symmetric<Eigen::Dynamic>(squares).vectors.col(8), of_z = sum * of_x;
  const auto rotation_of = [](const Eigen::VectorXd& nine) {
    const Eigen::Matrix3d matrix = Eigen::Map<const Eigen::Matrix3d>(nine.data());
    return nearest_rotation(matrix.determinant() < 0 ? Eigen::Matrix3d(-matrix) : matrix);
  };
  RobotWorld start;
  start.hand_from_target.rotation = rotation_of(of_x);
  start.base_from_world.rotation = rotation_of(of_z);
  Eigen::MatrixXd matrix(3 * count, 6);
  Eigen::VectorXd right(3 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Station& station = stations[std::size_t(i)];
    matrix.block<3, 3>(3 * i, 0) = station.base_from_hand.rotation;
    matrix.block<3, 3>(3 * i, 3) = -Eigen::Matrix3d::Identity();
    right.segment<3>(3 * i) = start.base_from_world.rotation * station.world_from_target.translation_mm -
                              station.base_from_hand.translation_mm;
  }
  const Eigen::VectorXd shifts = least(matrix, right);
  start.hand_from_target.translation_mm = shifts.head<3>();
  start.base_from_world.translation_mm = shifts.tail<3>();
  const auto at = [&](const Eigen::VectorXd& change) {
    return RobotWorld{changed(start.hand_from_target, Eigen::Vector3d::Zero(), change.head<6>()),
                      changed(start.base_from_world, Eigen::Vector3d::Zero(), change.tail<6>())};
  };
  const LeastSquares found = least_squares(
      [&](const Eigen::VectorXd& change) {
        const RobotWorld now = at(change);
        Eigen::VectorXd all(6 * count);
        for (Eigen::Index i = 0; i < count; ++i) {
          const RigidTransform one = stations[std::size_t(i)].base_from_hand * now.hand_from_target,
                               other = now.base_from_world * stations[std::size_t(i)].world_from_target;
          all.segment<3>(6 * i) = vector_from_rotation(other.rotation * one.rotation.transpose()) / radians(1);
          all.segment<3>(6 * i + 3) = other.translation_mm - one.translation_mm;
        }
        return all;
      },
      (Eigen::VectorXd(12) << 1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3).finished(), 30);
  return at(found.change);
}

}  // namespace marrow::robot
