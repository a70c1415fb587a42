// SPDX-License-Identifier: Apache-2.0
// A bone that turns and shifts to and fro, frame by frame, for studies of following bones.
#include <marrow/plugin.hpp>

#include "marrow/simulate/posture.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using phantom::Fragment, phantom::Phantom, phantom::Posture;

struct Options {
  int frames = 100;
  double frame_rate_hz = 250;
  double period_s = 0.8;
  std::array<double, 3> rotation_deg{6, 4, 60}, translation_mm{4, 3, 6};
};

List<Posture> bone_motion(const Phantom& phantom, const Options& options) {
  phantom::check_phantom(phantom, "simulate.bone_motion");
  List<Posture> postures;
  for (int i = 0; i < options.frames; ++i) {
    const double phase = 2 * kPi * i / options.frame_rate_hz / options.period_s;
    const double turned = 0.5 * (1 - std::cos(phase)), shifted = std::sin(phase);
    Vector6d motion;
    for (int axis = 0; axis < 3; ++axis) {
      motion[axis] = turned * radians(options.rotation_deg[std::size_t(axis)]);
      motion[3 + axis] = shifted * options.translation_mm[std::size_t(axis)];
    }
    Posture posture;
    for (const Fragment& fragment : phantom.fragments)
      posture.world_from_ct.push_back(moved(fragment.world_from_ct, fragment.frame, motion));
    postures.add(track::frame_name(std::size_t(i) + 1), posture);
  }
  return postures;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("simulate.bone_motion", bone_motion)
      .summary("A bone that turns and shifts to and fro: its posture in each frame of a sequence")
      .in("phantom", "a bone; each fragment moves about its own axes")
      .out("postures", "where it is, frame by frame; the soft tissue keeps its place", over("frame"))
      .option("frames", &Options::frames, "number of frames", at_least(1), at_most(100000))
      .option("frame_rate_hz", &Options::frame_rate_hz, "frames a second", at_least(1e-3), unit("Hz"))
      .option("period_s", &Options::period_s, "time from one end of the motion to the other and back", at_least(1e-3),
              unit("s"))
      .option("rotation_deg", &Options::rotation_deg,
              "largest rotation vector, about the frontal, the lateral and the long axis; 0 in the first frame")
      .option("translation_mm", &Options::translation_mm,
              "amplitude of the shift along the same axes, a quarter of a period ahead of the rotation");
}
