// SPDX-License-Identifier: Apache-2.0
// Seeds, landmarks and poses from files.
#include "marrow/base/printable.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"
#include "workbench/xray.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// By fragment: [[x, y, z], ...].
json json_of_seeds(const List<Seeds>& seeds) {
  json fragments = json::object();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    json points = json::array();
    for (const Eigen::Vector3d& point : seeds[i].points_mm) points.push_back(json_of(point));
    fragments[seeds.name(i)] = {{"seeds", points}, {"register", seeds[i].wanted}};
  }
  return fragments;
}

/// The list of a draft's document, with the fragment of each landmark.
json json_of_landmarks(const List<Landmarks>& fragments) {
  json list = json::array();
  for (std::size_t i = 0; i < fragments.size(); ++i)
    for (const Landmarks::Point& point : fragments[i].points) {
      json landmark = {{"name", point.name}, {"fragment", fragments.name(i)}, {"model_mm", json_of(point.model_mm)}};
      for (const Landmarks::Seen& seen : fragments[i].seen)
        if (seen.name == point.name) landmark["pixels"][seen.view] = {seen.pixel.x(), seen.pixel.y()};
      list.push_back(landmark);
    }
  return list;
}

/// What a file holds: {seeds}, {landmarks} or {world_from_ct}, and the command that reads it.
json imported(const Workbench& workbench, const Request& request) {
  const std::string what = request.parameter("what");
  if (what != "seeds" && what != "landmarks" && what != "pose")
    throw Error("seeds, landmarks or a pose can be imported, not '" + printable(what) + "'");
  const std::string path = workbench.folder.inside(request.parameter("path")).string();
  const NodeCall call{"read." + what, {{"path", path}}};
  const Ran ran = run(call, workbench);
  const Value& value = ran.outputs.at(what);
  json answer = {{"command", command_of(call)}, {"warnings", ran.warnings}};
  if (what == "seeds") answer["seeds"] = json_of_seeds(value.as_list<Seeds>());
  if (what == "landmarks") answer["landmarks"] = json_of_landmarks(value.as_list<Landmarks>());
  if (what == "pose") answer["world_from_ct"] = json_of(value.as<Pose>().world_from_model);
  return answer;
}

}  // namespace

void add_xray_exchange(Server& server, Workbench& workbench) {
  server.get("/api/xray/import", [&](const Request& request) { return json_answer(imported(workbench, request)); });
}

}  // namespace marrow::workbench
