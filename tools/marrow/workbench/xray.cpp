// SPDX-License-Identifier: Apache-2.0
#include "workbench/xray.hpp"

#include "marrow/domain/printable.hpp"
#include "marrow/runtime/hash.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {

using nlohmann::json;

void add_xray_page(Server& server, Workbench& workbench) {
  for (const auto add : {add_xray_views, add_xray_checks, add_xray_masks, add_xray_exchange}) add(server, workbench);
}

std::string set_text(const json& value) {
  std::string text;
  for (const char c : value.dump(-1, ' ', false, json::error_handler_t::replace))
    text += c == '$' ? "$$" : std::string(1, c);
  return text;
}

fs::path working_file(const Workbench& workbench, const std::string& name, const std::string& ending,
                      const std::string& text) {
  const fs::path folder = workbench.folder.inside(".marrow/drafts");
  fs::create_directories(folder);
  const fs::path file = folder / (name + "-" + hash_of_bytes(text.data(), text.size()).hex() + ending);
  if (!fs::exists(file)) files::write_text(file, text);
  return file;
}

fs::path camera_file(const Workbench& workbench, const json& camera) {
  if (!camera.is_object() || camera.empty())
    throw Error("this view has no camera; give a camera file, or the angles and distances of the C-arm");
  if (const auto file = camera.find("file"); file != camera.end() && file->is_string())
    return workbench.folder.inside(file->get<std::string>());
  json written = camera;
  written["marrow-camera"] = 1;
  return working_file(workbench, "camera", ".yaml", written.dump(1) + "\n");
}

DistortedCamera distorted_camera(const Workbench& workbench, const json& camera) {
  return files::read_camera_file(camera_file(workbench, camera));
}

std::vector<Override> overrides_of(const Workbench& workbench, const json& views) {
  json names = json::array(), images = json::array(), cameras = json::array();
  for (const json& view : views) {
    names.push_back(view.at("name"));
    images.push_back(workbench.folder.inside(view.at("image").get<std::string>()).string());
    cameras.push_back(camera_file(workbench, view.at("camera")).string());
  }
  return {{"views.names", set_text(names)}, {"views.images", set_text(images)}, {"views.cameras", set_text(cameras)}};
}

PipelineCall image_call(const Workbench& workbench, const std::string& image) {
  return {workbench_pipeline("image"), {{{"image", workbench.folder.inside(image).string()}}, {}}, {}, {}, false};
}

Ran run(const PipelineCall& call, const Workbench& workbench) {
  Job job("", "");
  Ran ran{outputs_of(call, workbench, job), {}};
  const json events = job.state(0, 0)["events"];
  for (const json& event : events)
    if (event.value("event", "") == "warning") ran.warnings.push_back(event.value("text", ""));
  return ran;
}

}  // namespace marrow::workbench
