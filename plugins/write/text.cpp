// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "marrow/write/json_out.hpp"

namespace {

using marrow::files::write_text;

void pose(const marrow::Pose& pose, const std::string& path) {
  check_pose(pose, path);
  write_text(path, marrow::files::pose(pose));
}

void truth(const marrow::Truth& truth, const std::string& path) {
  check_rigid(truth.world_from_model, path);
  write_text(path, marrow::files::truth(truth));
}

void camera(const marrow::Camera& camera, const std::string& path) {
  check_camera(camera, path);
  write_text(path, marrow::files::camera(camera));
}

void shaft_lines(const marrow::ShaftLines& lines, const std::string& path) {
  write_text(path, marrow::files::shaft_lines(lines));
}

void seeds(const marrow::Seeds& seeds, const std::string& path) { write_text(path, marrow::files::seeds(seeds)); }

void verdict(const marrow::Verdict& verdict, const std::string& path) {
  write_text(path, marrow::files::verdict(verdict));
}

void stop(const marrow::Stop& stop, const std::string& path) {
  marrow::write::write_json(path, {{"stops", stop.stops}, {"reason", stop.reason}});
}

/// A file holds the landmarks of one fragment, and is named after it.
void landmarks(const marrow::Landmarks& landmarks, const std::string& path) {
  const std::string fragment = marrow::files::unescaped_name(std::filesystem::path(path).stem().string());
  write_text(path, marrow::files::landmarks(landmarks, fragment));
}

void metrics(const marrow::Metrics& metrics, const std::string& path) {
  nlohmann::ordered_json json = {{"metrics", nlohmann::ordered_json::array()}};
  for (const marrow::Metric& metric : metrics.items)
    json["metrics"].push_back({{"name", metric.name}, {"value", metric.value}, {"unit", metric.unit}});
  marrow::write::write_json(path, json);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::Pose>(".yaml", pose, "pose with its frames, 4x4 matrix, predicted deviations and warnings");
  plugin.writer<marrow::Truth>(".yaml", truth, "exact pose with its frames and 4x4 matrix");
  plugin.writer<marrow::Camera>(".yaml", camera, "camera with its matrices");
  plugin.writer<marrow::ShaftLines>(".yaml", shaft_lines, "the pair of borders, and the rejected pairs with reasons");
  plugin.writer<marrow::Seeds>(".yaml", seeds, "points of one fragment");
  plugin.writer<marrow::Verdict>(".yaml", verdict, "judgement of a pose, with reasons, remedies and figures");
  plugin.writer<marrow::Landmarks>(".yaml", landmarks, "landmarks of the fragment that the file is named after");
  plugin.writer<marrow::Stop>(".json", stop, "whether a repetition ends, and why");
  plugin.writer<marrow::Metrics>(".json", metrics, "figures of merit with units");
}
