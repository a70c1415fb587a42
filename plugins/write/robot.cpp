// SPDX-License-Identifier: Apache-2.0
// Writes what a robot and its guide know, as JSON.

#include "marrow/toolbox/robotics/robot_state.hpp"
#include "marrow/write/json_out.hpp"

namespace {

using namespace marrow;
using nlohmann::ordered_json;
using write::write_json;

ordered_json json_of(const RigidTransform& transform) {
  ordered_json rows = ordered_json::array();
  for (int row = 0; row < 3; ++row)
    rows.push_back({transform.rotation(row, 0), transform.rotation(row, 1), transform.rotation(row, 2),
                    transform.translation_mm[row]});
  return {{"target", transform.target}, {"source", transform.source}, {"matrix", rows}};
}

ordered_json json_of(const robot::Load& load) { return {{"force_N", load.force_n}, {"torque_Nm", load.torque_nm}}; }

void report(const robot::RobotReport& report, const std::string& path) {
  write_json(path, {{"done", json_of(report.done)},
                    {"robot_from_world", json_of(report.robot_from_world)},
                    {"load", json_of(report.load)},
                    {"largest_load", json_of(report.largest_load)},
                    {"warning", report.is_warning},
                    {"stopped", report.stopped}});
}

void robot_state(const robot::RobotState& state, const std::string& path) {
  write_json(path, {{"moves", state.moves},
                    {"base_from_platform", json_of(state.base_from_platform)},
                    {"world_from_base", json_of(state.world_from_base)},
                    {"world_from_ct", json_of(state.world_from_ct)}});
}

void guide_state(const robot::GuideState& state, const std::string& path) {
  ordered_json moves = ordered_json::array();
  for (const robot::Move& move : state.moves)
    moves.push_back({{"told", json_of(move.told)}, {"seen", json_of(move.seen)}});
  write_json(
      path,
      {{"pairs", state.pairs}, {"images", state.images}, {"errors_in_tolerances", state.errors}, {"moves", moves}});
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<robot::RobotReport>(".json", report, "what a robot says: its motion, the load, why it stopped");
  plugin.writer<robot::RobotState>(".json", robot_state, "a simulated robot with its exact place");
  plugin.writer<robot::GuideState>(".json", guide_state, "pairs, moves as told and as seen");
}
