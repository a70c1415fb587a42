// SPDX-License-Identifier: Apache-2.0
// The way of a bone as one value, and as a table (CSV) that other programs read.
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/track/track_state.hpp"

namespace {

using namespace marrow;
using track::TrackState;
using track::Trajectory;

Trajectory trajectory(const List<TrackState>& states, const List<Verdict>* verdicts) {
  if (verdicts && verdicts->names() != states.names())
    throw Error(
        formatted("the verdicts are of other frames than the states: {} and {}; wire both to the same repetition",
                  verdicts->size(), states.size()));
  Trajectory result;
  for (std::size_t i = 0; i < states.size(); ++i) {
    result.frames.push_back(states.name(i));
    result.states.push_back(states[i]);
    if (verdicts) result.verdicts.push_back((*verdicts)[i]);
  }
  return result;
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

constexpr const char* kAxes[] = {"frontal_deg", "lateral_deg", "axial_deg", "frontal_mm", "lateral_mm", "along_mm"};

/// A row of world_from_model (row-major), then the motion from the first frame along the bone's six axes, then the
/// deviations along them, then the verdict and its probability of a failure, which are empty where there is none.
void write_csv(const Trajectory& trajectory, const std::string& path) {
  std::string text = "frame,name,time_s,found";
  for (int row = 1; row <= 3; ++row)
    for (int column = 1; column <= 4; ++column) text += formatted(",m{}{}{}", row, column, column == 4 ? "_mm" : "");
  for (const char* prefix : {",", ",deviation_"})
    for (const char* axis : kAxes) text += std::string(prefix) + axis;
  text += ",verdict,failure_probability,note\n";
  const auto add = [&](double value) {
    const std::string number = formatted(",{:.10g}", value);
    text += number;
  };
  const auto add_degrees_and_mm = [&](const Vector6d& values) {
    for (int k = 0; k < 6; ++k) add(k < 3 ? degrees(values[k]) : values[k]);
  };
  for (std::size_t i = 0; i < trajectory.states.size(); ++i) {
    const TrackState& state = trajectory.states[i];
    text += formatted("{},{}", state.frame + 1, quoted(trajectory.frames[i]));
    add(state.time_s());
    text += state.is_found() ? ",1" : ",0";
    const RigidTransform& pose = state.now.world_from_model;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) add(pose.rotation(row, column));
      add(pose.translation_mm[row]);
    }
    add_degrees_and_mm(
        motion_between(trajectory.states.front().now.world_from_model, pose, trajectory.states.front().fragment));
    add_degrees_and_mm(state.now.covariance.diagonal().head<6>().cwiseSqrt());
    if (trajectory.verdicts.empty()) {
      text += ",,";
    } else {
      text += "," + std::string(name_of(trajectory.verdicts[i].judgement));
      add(trajectory.verdicts[i].failure_probability);
    }
    text += "," + quoted(state.note) + "\n";
  }
  files::write_text(path, text);
}

void write_state(const TrackState& state, const std::string& path) { write_csv({{""}, {state}, {}}, path); }

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("track.trajectory", trajectory)
      .summary("The way of a bone through all frames, as one table")
      .in("states", "what is known after each frame", over("frame"))
      .in("verdicts", "whether the pose of each frame can be relied on", over("frame"))
      .out("trajectory", "poses, deviations, and in which frames the bone was found");
  plugin.writer<TrackState>(".csv", write_state, "one frame: time, 3x4 matrix world_from_model, motion, deviations");
  plugin.writer<Trajectory>(
      ".csv", write_csv,
      "one line per frame: time, 3x4 matrix world_from_model, motion from the first frame, deviations, verdict");
}
