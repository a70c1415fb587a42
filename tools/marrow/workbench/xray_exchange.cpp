// SPDX-License-Identifier: Apache-2.0
// Seeds, landmarks and poses from files and to files.
#include "marrow/domain/pose.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

json json_of_place(const Eigen::Vector3d& place) { return {place.x(), place.y(), place.z()}; }

/// By fragment: [[x, y, z], ...].
json json_of_seeds(const List<Seeds>& seeds) {
  json fragments = json::object();
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    json points = json::array();
    for (const Eigen::Vector3d& point : seeds[i].points_mm) points.push_back(json_of_place(point));
    fragments[seeds.name(i)] = {{"seeds", points}, {"register", seeds[i].wanted}};
  }
  return fragments;
}

/// A list as a draft's document has it, with the fragment of each.
json json_of_landmarks(const List<Landmarks>& fragments) {
  json list = json::array();
  for (std::size_t i = 0; i < fragments.size(); ++i)
    for (const Landmarks::Point& point : fragments[i].points) {
      json landmark = {
          {"name", point.name}, {"fragment", fragments.name(i)}, {"model_mm", json_of_place(point.model_mm)}};
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
  const PipelineCall call{workbench_pipeline("import-" + what),
                          {{{"path", workbench.folder.inside(request.parameter("path")).string()}}, {}},
                          {},
                          {},
                          false};
  const Ran ran = run(call, workbench);
  const Value& value = ran.outputs.at(what);
  json answer = {{"command", command_of(call)}, {"warnings", ran.warnings}};
  if (what == "seeds") answer["seeds"] = json_of_seeds(value.as_list<Seeds>());
  if (what == "landmarks") answer["landmarks"] = json_of_landmarks(value.as_list<Landmarks>());
  if (what == "pose") answer["world_from_ct"] = json_of(value.as<Pose>().world_from_model);
  return answer;
}

/// A place for a new file, below a folder that is there.
fs::path place_for(const Workbench& workbench, const std::string& path) {
  const fs::path file = workbench.folder.inside(path);
  if (file.extension() != ".yaml" && file.extension() != ".yml")
    throw Error("'" + printable(path) + "': the name must end in .yaml");
  if (fs::exists(file)) throw Error("'" + printable(path) + "' is there already; give another name");
  if (!fs::is_directory(file.parent_path()))
    throw Error("'" + printable(path) + "': there is no such folder; make it first");
  return file;
}

json with_version(const std::string& key, const json& content) {
  json file = content;
  file[key] = 1;
  return file;
}

/// The file's text in marrow's format. `content` is {fragments} for seeds and landmarks, and {matrix} for a pose.
std::string exported(const std::string& what, const json& content) {
  if (what == "seeds" || what == "landmarks") {
    const json fragments = content.value("fragments", json());
    if (!fragments.is_object() || fragments.empty()) throw Error("there are no " + what + " to export");
    return with_version("marrow-" + what, {{"fragments", fragments}}).dump(1) + "\n";
  }
  if (what != "pose") throw Error("seeds, landmarks or a pose can be exported, not '" + printable(what) + "'");
  return with_version("marrow-pose", {{"target", "world"}, {"source", "ct"}, {"matrix", content.at("matrix")}})
             .dump(1) +
         "\n";
}

}  // namespace

void add_xray_exchange(Server& server, Workbench& workbench) {
  server.get("/api/xray/import", [&](const Request& request) { return json_answer(imported(workbench, request)); });
  server.post("/api/xray/export", [&](const Request& request) {
    const fs::path file = place_for(workbench, request.text("path"));
    files::write_text(file, exported(request.text("what"), request.body.value("content", json::object())));
    return json_answer({{"path", workbench.folder.relative(file)}});
  });
}

}  // namespace marrow::workbench
