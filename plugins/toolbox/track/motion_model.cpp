// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/track/motion_model.hpp"

#include <Eigen/Cholesky>
#include <cmath>

#include "marrow/domain/decompositions.hpp"

namespace marrow::track {
namespace {

/// Turns a small change of a motion's numbers into the small motion that follows the motion: by the right Jacobian of
/// SO(3) for rotations (Sola, eq. 183), and by the inverse rotation for translations.
Matrix6d of_addition(const Vector6d& motion) {
  const Eigen::Vector3d turn = motion.head<3>();
  const double angle = turn.norm();
  const Eigen::Matrix3d cross = cross_matrix(turn);
  Matrix6d matrix = Matrix6d::Zero();
  matrix.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() - 0.5 * cross;
  if (angle > 1e-4)
    matrix.topLeftCorner<3, 3>() = Eigen::Matrix3d::Identity() - (1 - std::cos(angle)) / (angle * angle) * cross +
                                   (angle - std::sin(angle)) / (angle * angle * angle) * cross * cross;
  matrix.bottomRightCorner<3, 3>() = rotation_from_vector(turn).transpose();
  return matrix;
}

/// How an error before a frame becomes the error after it. The bone moves by m = velocity * dt; an error (r, t) before
/// that motion is the error (R^T r, R^T (t + r x t_m)) after it, with R and t_m of the motion.
Matrix12d transition(const Vector6d& velocity_per_s, double dt_s) {
  const Vector6d motion = velocity_per_s * dt_s;
  const Eigen::Matrix3d back = rotation_from_vector(motion.head<3>()).transpose();
  Matrix12d matrix = Matrix12d::Identity();
  matrix.block<3, 3>(0, 0) = back;
  matrix.block<3, 3>(3, 0) = -back * cross_matrix(motion.tail<3>());
  matrix.block<3, 3>(3, 3) = back;
  matrix.topRightCorner<6, 6>() = dt_s * of_addition(motion);
  return matrix;
}

/// The covariance that white acceleration adds during one frame: the integral, over the moments of the frame, of what a
/// change of velocity at that moment has become by the frame's end. Gauss and Legendre's sum over three moments is
/// exact for a bone that does not turn: on each axis a^2 (dt^4 / 3, dt^3 / 2; dt^3 / 2, dt^2) for motion and velocity.
Matrix12d process_noise(const Vector6d& acceleration_per_s2, const Vector6d& velocity_per_s, double dt_s) {
  constexpr double kOff = 0.3872983346207417;  // sqrt(3 / 20)
  constexpr std::array<double, 3> kLeft{0.5 - kOff, 0.5, 0.5 + kOff}, kWeight{5 / 18.0, 8 / 18.0, 5 / 18.0};
  Matrix12d sum = Matrix12d::Zero();
  for (std::size_t i = 0; i < kLeft.size(); ++i) {
    const double left_s = kLeft[i] * dt_s;
    Eigen::Matrix<double, 12, 6> effect;
    effect << left_s * of_addition(velocity_per_s * left_s), Matrix6d::Identity();
    sum += kWeight[i] * dt_s * dt_s * effect * acceleration_per_s2.cwiseAbs2().asDiagonal() * effect.transpose();
  }
  return sum;
}

Matrix6d innovation_covariance(const TrackState& state, const Measurement& measured) {
  return state.predicted.covariance.topLeftCorner<6, 6>() + measured.covariance;
}

Vector6d innovation(const TrackState& state, const Measurement& measured) {
  return motion_between(state.predicted.world_from_model, measured.world_from_model, state.fragment);
}

Matrix12d symmetric(const Matrix12d& matrix) { return 0.5 * (matrix + matrix.transpose()); }

/// The noise of the measured poses from frame to frame, whatever covariances they came with. A steady motion hardly
/// shows in fourth differences; independent noise does, with 1 + 16 + 36 + 16 + 1 = 70 times its covariance. None if
/// there are too few frames in a row.
std::optional<Matrix6d> noise_of(const std::vector<TrackState>& states) {
  constexpr int kLeastCount = 20;
  constexpr std::array<double, 5> kDifference{1, -4, 6, -4, 1};
  Matrix6d sum = Matrix6d::Zero();
  int count = 0;
  for (std::size_t i = 2; i + 2 < states.size(); ++i) {
    const auto at = [&](std::size_t k) -> const std::optional<Measurement>& { return states[i + k - 2].measured; };
    if (!at(0) || !at(1) || !at(2) || !at(3) || !at(4)) continue;
    Vector6d difference = Vector6d::Zero();
    for (std::size_t k = 0; k < kDifference.size(); ++k)
      difference +=
          kDifference[k] * motion_between(at(2)->world_from_model, at(k)->world_from_model, states[i].fragment);
    sum += difference * difference.transpose();
    ++count;
  }
  if (count < kLeastCount) return std::nullopt;
  Vector6d least;  // so that poses without any noise have a covariance, too
  least << Eigen::Vector3d::Constant(1e-5), Eigen::Vector3d::Constant(1e-3);
  return Matrix6d(sum / (70.0 * count) + Matrix6d(least.cwiseAbs2().asDiagonal()));
}

/// The filter run again over the measurements of the states, with other accelerations.
std::vector<TrackState> filtered(const std::vector<TrackState>& states, const Vector6d& acceleration_per_s2,
                                 double& log_likelihood) {
  std::vector<TrackState> result;
  TrackState before = states.front();
  log_likelihood = 0;
  for (std::size_t i = 0; i < states.size(); ++i) {
    TrackState state = states.front();
    if (i > 0) {
      before.acceleration_per_s2 = acceleration_per_s2;
      state = predicted(before);
      state.note = states[i].note;
      state.usual_cost = states[i].usual_cost;
      if (states[i].measured) {
        const Eigen::LLT<Matrix6d> factor(innovation_covariance(state, *states[i].measured));
        const Vector6d y = innovation(state, *states[i].measured);
        log_likelihood -= 0.5 * y.dot(factor.solve(y)) + factor.matrixLLT().diagonal().array().log().sum();
        state = updated(state, *states[i].measured);
      }
    }
    state.acceleration_per_s2 = acceleration_per_s2;
    result.push_back(state);
    before = state;
  }
  return result;
}

/// One axis after the other, twice: which of several accelerations explains the measurements best.
Vector6d likeliest_acceleration(const std::vector<TrackState>& states) {
  constexpr int kSteps = 8;  // from the filter's own, each half of the one before
  Vector6d best = states.front().acceleration_per_s2;
  double most = 0;
  filtered(states, best, most);
  const Vector6d own = best;
  for (int round = 0; round < 2; ++round)
    for (int axis = 0; axis < 6; ++axis)
      for (int step = 0; step < kSteps; ++step) {
        Vector6d tried = best;
        tried[axis] = own[axis] * std::pow(0.5, step);
        double likelihood = 0;
        filtered(states, tried, likelihood);
        if (likelihood <= most) continue;
        most = likelihood;
        best = tried;
      }
  return best;
}

}  // namespace

std::string why_unknown(const std::optional<Matrix6d>& covariance) {
  constexpr double kLeast = 1e-6;  // degrees or mm: far below what any image tells
  if (!covariance || !covariance->allFinite()) return "the images do not determine the pose";
  if (covariance->isZero(0)) return "its predicted deviations are 0, so its registration compared nothing";
  Vector6d unit = Vector6d::Ones();
  unit.head<3>() *= degrees(1);
  if (!(eigen_of_symmetric<6>(unit.asDiagonal() * *covariance * unit.asDiagonal()).values[0] > kLeast * kLeast))
    return "its predicted deviation is 0 in one direction, which no image tells exactly";
  return "";
}

TrackState predicted(const TrackState& state) {
  const double dt_s = 1 / state.frame_rate_hz;
  TrackState next = state;
  ++next.frame;
  next.measured.reset();
  next.surprise = std::numeric_limits<double>::quiet_NaN();
  next.note.clear();
  const Kinematics& now = state.now;
  next.predicted.world_from_model = moved(now.world_from_model, state.fragment, now.velocity_per_s * dt_s);
  next.predicted.velocity_per_s = now.velocity_per_s;
  const Matrix12d by = transition(now.velocity_per_s, dt_s);
  next.predicted.covariance = symmetric(by * now.covariance * by.transpose() +
                                        process_noise(state.acceleration_per_s2, now.velocity_per_s, dt_s));
  next.now = next.predicted;
  return next;
}

double surprise(const TrackState& state, const Measurement& measured) {
  const Vector6d y = innovation(state, measured);
  return y.dot(innovation_covariance(state, measured).llt().solve(y));
}

TrackState updated(const TrackState& state, const Measurement& measured) {
  const Matrix12d& p = state.predicted.covariance;
  const Eigen::LLT<Matrix6d> factor(innovation_covariance(state, measured));
  const Eigen::Matrix<double, 12, 6> gain = factor.solve(p.topRows<6>()).transpose();
  const Vector12d error = gain * innovation(state, measured);
  TrackState next = state;
  next.now.world_from_model = moved(state.predicted.world_from_model, state.fragment, error.head<6>());
  next.now.velocity_per_s = state.predicted.velocity_per_s + error.tail<6>();
  // Joseph's form keeps the covariance positive.
  Matrix12d left = Matrix12d::Identity();
  left.leftCols<6>() -= gain;
  next.now.covariance = symmetric(left * p * left.transpose() + gain * measured.covariance * gain.transpose());
  next.surprise = surprise(state, measured);
  next.measured = measured;
  next.frames_lost = 0;
  return next;
}

Pose pose_of(const TrackState& state) {
  Pose pose;
  pose.world_from_model = state.now.world_from_model;
  pose.frame = state.fragment;
  pose.covariance = state.now.covariance.topLeftCorner<6, 6>();
  return pose;
}

std::vector<TrackState> smoothed(std::vector<TrackState> states) {
  if (states.empty()) throw Error("there is no frame to smooth");
  for (std::size_t i = 0; i < states.size(); ++i)
    if (states[i].frame != states.front().frame + int(i))
      throw Error(formatted("the frames to smooth do not follow each other: frame {} stands where frame {} is expected",
                            states[i].frame, states.front().frame + int(i)));
  if (const std::optional<Matrix6d> noise = noise_of(states))
    for (TrackState& state : states)
      if (state.measured) state.measured->covariance = *noise;
  double ignored = 0;
  std::vector<TrackState> result = filtered(states, likeliest_acceleration(states), ignored);
  for (std::size_t i = result.size() - 1; i-- > 0;) {
    const TrackState& next = result[i + 1];
    Kinematics& now = result[i].now;
    const Matrix12d by = transition(now.velocity_per_s, 1 / next.frame_rate_hz);
    const Matrix12d gain = next.predicted.covariance.ldlt().solve(by * now.covariance).transpose();
    Vector12d error;
    error << motion_between(next.predicted.world_from_model, next.now.world_from_model, next.fragment),
        next.now.velocity_per_s - next.predicted.velocity_per_s;
    const Vector12d correction = gain * error;
    now.world_from_model = moved(now.world_from_model, next.fragment, correction.head<6>());
    now.velocity_per_s += correction.tail<6>();
    now.covariance =
        symmetric(now.covariance + gain * (next.now.covariance - next.predicted.covariance) * gain.transpose());
  }
  return result;
}

}  // namespace marrow::track
