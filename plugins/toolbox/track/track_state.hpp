// SPDX-License-Identifier: Apache-2.0
#pragma once
// What a filter knows of a moving bone, from frame to frame.
#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::track {

using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// A bone's pose and velocity. Velocities and covariances refer to small motions (r [rad], t [mm]) in the fragment's
/// frame, as defined at Pose: moved(world_from_model, frame, velocity_per_s * dt_s) is the pose after dt_s.
struct Kinematics {
  RigidTransform world_from_model{"world", "ct"};
  Vector6d velocity_per_s = Vector6d::Zero();
  Matrix12d covariance = Matrix12d::Identity();  ///< of the motion, then of the velocity

  using fields = Fields<&Kinematics::world_from_model, &Kinematics::velocity_per_s, &Kinematics::covariance>;
};

/// A pose that was found in a frame, with its covariance.
struct Measurement {
  RigidTransform world_from_model{"world", "ct"};
  Matrix6d covariance = Matrix6d::Identity();

  using fields = Fields<&Measurement::world_from_model, &Measurement::covariance>;
};

/// What is known after a frame.
struct TrackState {
  int frame = -1;  ///< its number from 0 on; -1: before the first
  double frame_rate_hz = 0;
  /// Standard deviations of a frame's mean accelerations [rad/s^2, mm/s^2] along the six axes. The accelerations are
  /// white: independent from moment to moment. So during a frame each velocity changes by the acceleration times the
  /// frame's time.
  Vector6d acceleration_per_s2 = Vector6d::Ones();
  FragmentFrame fragment;
  Kinematics now;                       ///< with the frame's measurement, if there is one
  Kinematics predicted;                 ///< from the frames before
  std::optional<Measurement> measured;  ///< absent: the bone was not found
  int frames_lost = 0;                  ///< in a row, this one included
  /// Squared Mahalanobis distance of the frame's pose from the prediction. NaN if no pose was found.
  double surprise = std::numeric_limits<double>::quiet_NaN();
  double usual_cost = std::numeric_limits<double>::quiet_NaN();  ///< of the poses found so far, a moving mean
  double noise_scale = 1;  ///< factor on the covariances of registered poses, found from the surprises so far
  std::optional<Matrix6d> usual_covariance;  ///< of the last pose found, as it was registered
  std::string note;                          ///< why the frame's pose was not taken, in words

  bool is_found() const { return measured.has_value(); }
  double time_s() const { return frame / frame_rate_hz; }
  using fields = Fields<&TrackState::frame, &TrackState::frame_rate_hz, &TrackState::acceleration_per_s2,
                        &TrackState::fragment, &TrackState::now, &TrackState::predicted, &TrackState::measured,
                        &TrackState::frames_lost, &TrackState::surprise, &TrackState::usual_cost,
                        &TrackState::noise_scale, &TrackState::usual_covariance, &TrackState::note>;
};

/// The bone's way through a sequence.
struct Trajectory {
  std::vector<std::string> frames;  ///< their names
  std::vector<TrackState> states;   ///< as many
  std::vector<Verdict> verdicts;    ///< as many, or none
  using fields = Fields<&Trajectory::frames, &Trajectory::states, &Trajectory::verdicts>;
};

/// A bone's poses in Autoscoper's format (.tra): world from bone, frame by frame; nothing where it was not tracked.
struct AutoscoperTrack {
  std::vector<std::optional<RigidTransform>> world_from_bone;
  using fields = Fields<&AutoscoperTrack::world_from_bone>;
};

/// How a frame is called in lists over "frame": its number from 1, with four digits at least.
inline std::string frame_name(std::size_t number) { return formatted("{:04}", number); }

/// What all devices show at one moment of a sequence: a view of each, with different names.
struct SequenceFrame {
  std::vector<View> views;

  using fields = Fields<&SequenceFrame::views>;
};

}  // namespace marrow::track

MARROW_VALUE_TYPE(marrow::track::TrackState, "track_state", 1)
MARROW_VALUE_TYPE(marrow::track::Trajectory, "trajectory", 2)
MARROW_VALUE_TYPE(marrow::track::AutoscoperTrack, "autoscoper_track", 1)

MARROW_VALUE_TYPE(marrow::track::SequenceFrame, "sequence_frame", 1)
