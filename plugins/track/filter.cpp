// SPDX-License-Identifier: Apache-2.0
// Updates the state by a frame's registered pose, or finds that the bone is lost in this frame.
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/track/motion_model.hpp"

namespace {

using namespace marrow;
using track::Measurement;
using track::TrackState;

struct Options {
  double gate = 38.26;
  double max_cost_ratio = 2;
  double first_scale = 2;
  double added_deviation_deg = 0.02;
  double added_deviation_mm = 0.02;
};

struct Frame {
  TrackState state;
  Pose pose;
};

/// The measurement of a pose in the state's axes. Its deviations are at least those of the options, because a
/// covariance that is too small would shut out all later frames.
Measurement measured_by(const Pose& pose, double scale, const Options& options) {
  Measurement measured{pose.world_from_model, scale * *pose.covariance};
  for (int i = 0; i < 6; ++i) {
    const double least = i < 3 ? radians(options.added_deviation_deg) : options.added_deviation_mm;
    measured.covariance(i, i) += least * least;
  }
  return measured;
}

/// Why the frame's pose is not taken. Empty if it is.
std::string why_lost(const TrackState& state, const Pose* pose, const Verdict* verdict, double surprise,
                     const Options& options) {
  if (!pose) return "no pose was found";
  if (std::string unknown = track::why_unknown(pose->covariance); !unknown.empty()) return unknown;
  if (verdict && verdict->judgement == Judgement::wrong)
    return "its verdict is wrong" + (verdict->reasons.empty() ? "" : ": " + verdict->reasons[0]);
  if (pose->cost > options.max_cost_ratio * state.usual_cost)
    return formatted("its cost is {:.3g}, where {:.3g} is usual", pose->cost, state.usual_cost);
  if (!(surprise <= options.gate))
    return formatted("it is not where the motion leads: squared distance {:.3g}, at most {:.3g}", surprise,
                     options.gate);
  return "";
}

Frame filter(const TrackState& predicted, const Pose* pose, const Verdict* verdict, const Options& options,
             Context& context) {
  if (pose) check_pose(*pose, "the registered pose");
  Frame frame{predicted, {}};
  TrackState& state = frame.state;
  std::optional<Measurement> measured;
  std::optional<Matrix6d> usual;
  const double scale = predicted.usual_covariance ? predicted.noise_scale : options.first_scale;
  if (pose && track::why_unknown(pose->covariance).empty()) {
    const Pose in_axes = in_frame(*pose, predicted.fragment);
    measured = measured_by(in_axes, scale, options);
    usual = in_axes.covariance;
  }
  const double surprise = measured ? track::surprise(predicted, *measured) : state.surprise;
  const std::string lost = why_lost(predicted, pose, verdict, surprise, options);
  if (lost.empty()) {
    state = track::updated(predicted, *measured);
    state.usual_covariance = usual;
    constexpr double kShare = 0.1, kShareOfCost = 0.3;  // of the newest frame in the scale and in the usual cost
    constexpr double kExpected = 6;
    // If the poses scatter more than their covariances predict, the surprises are too large on average.
    state.noise_scale = std::max(1.0, scale * (1 - kShare + kShare * surprise / kExpected));
    state.usual_cost =
        std::isnan(state.usual_cost) ? pose->cost : (1 - kShareOfCost) * state.usual_cost + kShareOfCost * pose->cost;
  } else {
    ++state.frames_lost;
    state.surprise = surprise;
    state.note = lost;
    context.warn(formatted("the bone is lost in frame {}: {}", state.frame + 1, lost));
  }
  frame.pose = track::pose_of(state);
  if (pose) frame.pose.cost = pose->cost;
  if (!lost.empty()) frame.pose.warnings.push_back(lost);
  return frame;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.filter", filter)
      .summary("A frame's pose from its registration and from the motion so far (error-state Kalman filter)")
      .in("state", "what is known before the frame, of track.predict")
      .in("pose", "pose that was registered in the frame, with its covariance; it may be missing")
      .in("verdict", "verdict on this pose: a wrong one is not taken")
      .out("state", &Frame::state, "what is known after the frame")
      .out("pose", &Frame::pose, "best pose of the frame with its covariance; where the bone is lost, the prediction")
      .option(
          "gate", &Options::gate,
          "largest squared Mahalanobis distance between the registered and the predicted pose (38.26: one right pose "
          "in a million is farther off); it is larger than the gate of register.tracked, which widens the search",
          at_least(0), unit(""))
      .option("max_cost_ratio", &Options::max_cost_ratio,
              "a pose with a larger cost is not taken; as a multiple of the usual cost of the frames so far",
              at_least(0), unit(""))
      .option("first_scale", &Options::first_scale,
              "factor on the covariances of the first registered poses; later it follows from how far they scatter",
              at_least(1), unit(""))
      .option("added_deviation_deg", &Options::added_deviation_deg, "deviation that is added to each registered angle",
              at_least(0))
      .option("added_deviation_mm", &Options::added_deviation_mm,
              "deviation that is added to each registered translation", at_least(0));
}
