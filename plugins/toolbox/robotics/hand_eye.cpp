// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/robotics/hand_eye.hpp"

#include <Eigen/LU>
#include <cmath>

#include "least_squares.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/domain/decompositions.hpp"

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
                     std::hypot(radians(noise.motion_deviation_deg), noise.motion_deviation_fraction * turn);
  result.tail<3>() = (move.seen * move.centre_mm - predicted * move.centre_mm) /
                     std::hypot(noise.motion_deviation_mm, noise.motion_deviation_fraction * shift);
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

/// No rotation and no shift is known better than this, however well the motions fit: it may be by chance.
constexpr double kLeastNoise_rad = 1e-4, kLeastNoise_mm = 0.01;

/// The variance of residuals, of which the fit has used up some; at least the square of `least`.
double variance_of(double squares, double freedom, double least) {
  return std::max(squares / std::max(1.0, freedom), least * least);
}

/// A matrix of information with a little more in all directions. Then what nothing determines has a huge but finite
/// variance.
Eigen::MatrixXd with_a_little(const Eigen::MatrixXd& information, double most) {
  return information + 1e-14 * most * Eigen::MatrixXd::Identity(information.rows(), information.cols());
}

/// Turns about one axis say nothing about how the robot is turned about it, and noise in them is no second axis. Both
/// show in the covariance: a turn counts by its size against the noise.
void check_turned(const Eigen::Matrix3d& covariance_of_turn, const std::string& what) {
  constexpr double kMost_deg = 10, kNothing_deg = 60;
  const double deviation_deg = degrees(std::sqrt(eigen_of_symmetric<3>(covariance_of_turn).values[2]));
  if (deviation_deg <= kMost_deg) return;
  const std::string known =
      deviation_deg < kNothing_deg
          ? formatted("it is known to {:.0f} degrees only (one standard deviation)", deviation_deg)
          : "about one axis nothing is known";
  throw Error(what + " do not tell how the robot is turned: " + known +
              "; turn it further, about axes that are at least 30 degrees apart");
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

HandEye solve_ax_xb(const std::vector<Move>& moves) {
  if (moves.size() < 2)
    throw Error(formatted("the hand-eye transform needs 2 motions or more; there are {}", moves.size()));
  const Eigen::Index rows = 3 * Eigen::Index(moves.size());
  Eigen::Matrix3d products = Eigen::Matrix3d::Zero(), information = Eigen::Matrix3d::Zero();
  for (const Move& move : moves) {
    const Eigen::Vector3d turn = vector_from_rotation(move.told.rotation);
    products += turn * vector_from_rotation(move.seen.rotation).transpose();
    information += turn.squaredNorm() * Eigen::Matrix3d::Identity() - turn * turn.transpose();
  }
  RigidTransform x{moves[0].told.source, moves[0].seen.source, nearest_rotation(products), Eigen::Vector3d::Zero()};
  double squares = 0;
  Eigen::MatrixXd matrix(rows, 3), by_turn(rows, 3);  // the right side's derivatives by a turn of X
  Eigen::VectorXd right(rows);
  for (std::size_t i = 0; i < moves.size(); ++i) {
    const Eigen::Index row = 3 * Eigen::Index(i);
    squares +=
        (vector_from_rotation(moves[i].told.rotation) - x.rotation * vector_from_rotation(moves[i].seen.rotation))
            .squaredNorm();
    matrix.middleRows<3>(row) = minus_identity(moves[i].told.rotation);
    right.segment<3>(row) = x.rotation * moves[i].seen.translation_mm - moves[i].told.translation_mm;
    by_turn.middleRows<3>(row) = -cross_matrix(x.rotation * moves[i].seen.translation_mm);
  }
  const Eigen::Matrix3d of_turn = variance_of(squares, double(rows - 3), kLeastNoise_rad) *
                                  inverse_of(with_a_little(information, information.trace()));
  check_turned(of_turn, "the motions of the hand-eye transform");
  x.translation_mm = least(matrix, right);
  // A turn of X about the base's axes moves the least squares' solution by `lever`.
  const Eigen::Matrix3d inverse = inverse_of(with_a_little(matrix.transpose() * matrix, matrix.squaredNorm())),
                        lever = inverse * matrix.transpose() * by_turn;
  const double of_shift =
      variance_of((matrix * x.translation_mm - right).squaredNorm(), double(rows - 3), kLeastNoise_mm);
  Eigen::Matrix<double, 6, 3> by;  // a motion of the frame "reference", by the turn
  by << x.rotation.transpose(), x.rotation.transpose() * lever;
  HandEye found{x, by * of_turn * by.transpose()};
  found.covariance.bottomRightCorner<3, 3>() += x.rotation.transpose() * (of_shift * inverse) * x.rotation;
  return found;
}

namespace {

/// X and Z after a small motion of each.
RobotWorld changed(const RobotWorld& start, const Eigen::VectorXd& by) {
  return {changed(start.hand_from_target, Eigen::Vector3d::Zero(), by.head<6>()),
          changed(start.base_from_world, Eigen::Vector3d::Zero(), by.tail<6>())};
}

/// The differences between A X and Z B at each station: the rotation in units of `rotation_rad`, then the shift in
/// units of `shift_mm`.
Eigen::VectorXd differences(const std::vector<Station>& stations, const RobotWorld& found, double rotation_rad,
                            double shift_mm) {
  Eigen::VectorXd all(6 * Eigen::Index(stations.size()));
  for (std::size_t i = 0; i < stations.size(); ++i) {
    const RigidTransform one = stations[i].base_from_hand * found.hand_from_target,
                         other = found.base_from_world * stations[i].world_from_target;
    const Eigen::Index row = 6 * Eigen::Index(i);
    all.segment<3>(row) = vector_from_rotation(other.rotation * one.rotation.transpose()) / rotation_rad;
    all.segment<3>(row + 3) = (other.translation_mm - one.translation_mm) / shift_mm;
  }
  return all;
}

/// The least squares near a start, 1 degree counted as 1 mm, and the covariance of Z. If H is the sum's Hessian, and M
/// that with each residual multiplied by its own deviation, it is the part of H^-1 M H^-1 that belongs to Z: the
/// residuals' noise, as the solution follows it.
RobotWorld refined(const RobotWorld& start, const std::vector<Station>& stations) {
  const Eigen::VectorXd step =
      (Eigen::VectorXd(12) << 1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3, 1e-5, 1e-5, 1e-5, 1e-3, 1e-3, 1e-3).finished();
  const auto least_from = [&](const RobotWorld& from, double rotation_rad, double shift_mm, int most_rounds) {
    return least_squares(
        [&](const Eigen::VectorXd& by) { return differences(stations, changed(from, by), rotation_rad, shift_mm); },
        step, most_rounds);
  };
  RobotWorld found = changed(start, least_from(start, radians(1), 1, 30).change);
  const Eigen::VectorXd left = differences(stations, found, radians(1), 1);
  const auto by_station = left.reshaped(6, left.size() / 6);
  const double freedom = 0.5 * double(left.size()) - 6,
               rotation_deg =
                   std::sqrt(variance_of(by_station.topRows(3).squaredNorm(), freedom, degrees(kLeastNoise_rad))),
               shift_mm = std::sqrt(variance_of(by_station.bottomRows(3).squaredNorm(), freedom, kLeastNoise_mm));
  const Eigen::MatrixXd hessian = least_from(found, radians(1), 1, 1).hessian,
                        scatter = least_from(found, radians(1) / rotation_deg, 1 / shift_mm, 1).hessian;
  const double most = hessian.trace();
  const Eigen::MatrixXd gain = inverse_of(with_a_little(hessian, most)).bottomRows<6>();
  found.covariance = gain * with_a_little(scatter, most) * gain.transpose();
  return found;
}

}  // namespace

RobotWorld solve_ax_zb(const std::vector<Station>& stations) {
  const Eigen::Index count = Eigen::Index(stations.size());
  if (count < 3) throw Error(formatted("the robot's place needs 3 stations or more; there are {}", stations.size()));
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
  const RobotWorld found = refined(start, stations);
  check_turned(found.covariance.topLeftCorner<3, 3>(), "the stations of the robot");
  return found;
}

Matrix6d left_by(const RigidTransform& motion, const Matrix6d& covariance, const Eigen::Vector3d& place_mm) {
  // E W E^-1 is to first order e - Ad_W e after W. Ad_W takes (r, t) to (R r, R t + t_W x R r).
  Matrix6d by = Matrix6d::Identity();
  by.topLeftCorner<3, 3>() -= motion.rotation;
  by.bottomRightCorner<3, 3>() -= motion.rotation;
  by.bottomLeftCorner<3, 3>() -= cross_matrix(motion.translation_mm) * motion.rotation;
  Matrix6d about_place = Matrix6d::Identity();
  about_place.bottomLeftCorner<3, 3>() = -cross_matrix(place_mm);
  return about_place * by * covariance * by.transpose() * about_place.transpose();
}

}  // namespace marrow::robot
