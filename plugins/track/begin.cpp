// SPDX-License-Identifier: Apache-2.0
// What is known of a bone before the first frame of a sequence.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/geometry/fragments.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::TrackState;

struct Options {
  double frame_rate_hz = 30;
  double start_deg = 3;
  double start_mm = 3;
  double speed_deg_s = 100;
  double speed_mm_s = 200;
  double acceleration_deg_s2 = 2000;
  double acceleration_mm_s2 = 5000;
};

TrackState begin(const Pose& first, const Mesh* model, const Options& options, const Context& context) {
  check_pose(first, "the pose of the first frame");
  const Pose start = geometry::with_fragment_axes(first, model, context);
  TrackState state;
  state.frame_rate_hz = options.frame_rate_hz;
  state.acceleration_per_s2 << Eigen::Vector3d::Constant(radians(options.acceleration_deg_s2)),
      Eigen::Vector3d::Constant(options.acceleration_mm_s2);
  state.fragment = start.frame;
  state.now.world_from_model = start.world_from_model;
  track::Vector12d deviation;
  deviation << Eigen::Vector3d::Constant(radians(options.start_deg)), Eigen::Vector3d::Constant(options.start_mm),
      Eigen::Vector3d::Constant(radians(options.speed_deg_s)), Eigen::Vector3d::Constant(options.speed_mm_s);
  state.now.covariance = deviation.cwiseAbs2().asDiagonal();
  state.predicted = state.now;
  return state;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.begin", begin)
      .summary("What is known before the first frame: about where the bone is, and how fast it may move")
      .in("start", "approximate pose in the first frame, with the fragment's axes")
      .in("model", "surface of the fragment: it gives the axes of a start that has none")
      .out("state", "the bone at rest, with the deviations that the options give")
      .option("frame_rate_hz", &Options::frame_rate_hz, "frames per second", at_least(1e-6), unit("Hz"))
      .option("start_deg", &Options::start_deg, "standard deviation of the start's rotations", at_least(1e-6))
      .option("start_mm", &Options::start_mm, "standard deviation of the start's translations", at_least(1e-6))
      .option("speed_deg_s", &Options::speed_deg_s, "standard deviation of the first angular velocity", at_least(0),
              unit("deg/s"))
      .option("speed_mm_s", &Options::speed_mm_s, "standard deviation of the first velocity", at_least(0), unit("mm/s"))
      .option("acceleration_deg_s2", &Options::acceleration_deg_s2,
              "standard deviation of a frame's mean angular acceleration about each axis: the larger, the wider a "
              "frame is searched",
              at_least(1e-6), unit("deg/s^2"))
      .option("acceleration_mm_s2", &Options::acceleration_mm_s2,
              "standard deviation of a frame's mean acceleration along each axis", at_least(1e-6), unit("mm/s^2"));
}
