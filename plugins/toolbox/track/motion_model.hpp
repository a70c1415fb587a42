// SPDX-License-Identifier: Apache-2.0
#pragma once
// An error-state Kalman filter on SE(3) for a bone of constant velocity with white acceleration, and its smoother. The
// acceleration is white from moment to moment. If it were constant during each frame and large compared with the noise
// of the poses, it alone would explain any pose, and the filter would nearly oscillate (docs/tracking.md). Sola,
// Quaternion kinematics for the error-state Kalman filter, arXiv 1711.02508, 2017; Rauch, Tung, Striebel, AIAA Journal
// 3(8), 1965. The error is a small motion as defined at Pose and a difference of velocities.
#include <optional>
#include <string>
#include <vector>

#include "marrow/toolbox/track/track_state.hpp"

namespace marrow::track {

/// The state one frame later, without a measurement: `now` and `predicted` are the prediction.
TrackState predicted(const TrackState& state);

/// Why a registered pose with this covariance says nothing about the bone, in words; empty if the pose can be weighed.
/// It says nothing if the covariance is absent, not finite, or 0 in a direction: no registration knows a pose exactly,
/// so that one compared nothing. check_covariance() must accept the covariance.
std::string why_unknown(const std::optional<Matrix6d>& covariance);

/// The pose in `now` with its covariance.
Pose pose_of(const TrackState& state);

/// Squared Mahalanobis distance of a measured pose from the state's prediction. It is distributed as chi-squared with 6
/// degrees of freedom if the model holds.
double surprise(const TrackState& state, const Measurement& measured);

/// The predicted state with a measurement.
TrackState updated(const TrackState& state, const Measurement& measured);

/// The best estimate of each frame from all frames (Rauch-Tung-Striebel). `states`: of one filter, frame after frame.
/// If there are enough frames, the measurements' covariance is first replaced by how far they scatter from frame to
/// frame: the registration's own also covers errors that are the same in all frames, which no smoothing takes away.
/// Then the accelerations along each axis are chosen by the largest likelihood of the measurements, from a hundredth of
/// the filter's to the filter's own. Throws Error if there is no state, or if the frames' numbers are not consecutive.
std::vector<TrackState> smoothed(std::vector<TrackState> states);

}  // namespace marrow::track
