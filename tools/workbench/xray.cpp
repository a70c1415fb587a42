// SPDX-License-Identifier: Apache-2.0
#include "workbench/xray.hpp"

#include "marrow/base/printable.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {

using nlohmann::json;

void add_xray_page(Server& server, Workbench& workbench) {
  for (const auto add : {add_xray_views, add_xray_checks, add_xray_masks, add_xray_exchange, add_xray_export})
    add(server, workbench);
}

namespace {

/// Converts the camera file of another program into one of marrow's own. `open`: what the file leaves open.
fs::path converted_camera(const Workbench& workbench, const fs::path& file, const json& open,
                          const std::string& image) {
  PipelineCall call{workbench_pipeline("camera-file"),
                    {{{"image", workbench.folder.inside(image).string()}, {"camera", file.string()}}, {}}};
  for (const auto& [name, value] : open.items())
    call.arguments.overrides.push_back({"camera." + name, set_text(value)});
  return camera_file(workbench, camera_json(run(call, workbench).outputs.at("camera").as<Camera>()), image);
}

}  // namespace

json camera_json(const Camera& camera) {
  json written = json_of(camera);
  written["camera_from_world"] = {{"target", "camera"}, {"source", "world"}, {"matrix", written["camera_from_world"]}};
  return written;
}

fs::path camera_file(const Workbench& workbench, const json& camera, const std::string& image) {
  if (!camera.is_object() || camera.empty())
    throw Error("this view has no camera; give a camera file, or the angles and distances of the C-arm");
  if (const auto file = camera.find("file"); file != camera.end() && file->is_string()) {
    const fs::path place = workbench.folder.inside(file->get<std::string>());
    json open = camera;
    open.erase("file");
    return open.empty() ? place : converted_camera(workbench, place, open, image);
  }
  json written = camera;
  written["marrow-camera"] = 1;
  return working_file(workbench.folder, "camera", ".yaml", written.dump(1) + "\n");
}

files::CameraInFile distorted_camera(const Workbench& workbench, const json& camera, const std::string& image) {
  const fs::path file = camera_file(workbench, camera, image);
  return file.extension() == ".yaml" || file.extension() == ".yml" ? files::read_camera_file(file)
                                                                   : files::CameraInFile();
}

std::vector<Override> overrides_of(const Workbench& workbench, const json& views) {
  json names = json::array(), images = json::array(), cameras = json::array();
  for (const json& view : views) {
    names.push_back(view.at("name"));
    images.push_back(workbench.folder.inside(view.at("image").get<std::string>()).string());
    cameras.push_back(camera_file(workbench, view.at("camera"), view.at("image").get<std::string>()).string());
  }
  return {{"views.names", set_text(names)}, {"views.images", set_text(images)}, {"views.cameras", set_text(cameras)}};
}

NodeCall image_call(const Workbench& workbench, const std::string& image) {
  return {"read.image", {{"path", workbench.folder.inside(image).string()}}};
}

namespace {

template <class Call>
Ran run_during_request(const Call& call, const Workbench& workbench) {
  Job job("", "");
  Ran ran{outputs_of(call, workbench, job), {}};
  const json events = job.state(0, 0)["events"];
  for (const json& event : events)
    if (event.value("event", "") == "warning") ran.warnings.push_back(event.value("text", ""));
  return ran;
}

}  // namespace

Ran run(const PipelineCall& call, const Workbench& workbench) { return run_during_request(call, workbench); }

Ran run(const NodeCall& call, const Workbench& workbench) { return run_during_request(call, workbench); }

}  // namespace marrow::workbench
