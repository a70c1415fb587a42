// SPDX-License-Identifier: Apache-2.0
// Writes the data of a report's interactive parts as JSON. tools/report/page/data.js reads it and describes it.
#include <bit>
#include <cmath>
#include <cstring>
#include <marrow/base/plain_text.hpp>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/samples_out.hpp"
#include "marrow/write/json_out.hpp"

namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "the page reads little-endian numbers");

template <class T>
std::string encoded(const std::vector<T>& numbers) {
  return marrow::base64({reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)});
}

ordered_json rows(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  ordered_json numbers = ordered_json::array();
  for (Eigen::Index r = 0; r < matrix.rows(); ++r)
    for (Eigen::Index c = 0; c < matrix.cols(); ++c) numbers.push_back(matrix(r, c));
  return numbers;
}

ordered_json rows(const marrow::RigidTransform& transform) {
  Eigen::Matrix4d whole = Eigen::Matrix4d::Identity();
  whole.topLeftCorner<3, 3>() = transform.rotation;
  whole.topRightCorner<3, 1>() = transform.translation_mm;
  return rows(whole);
}

ordered_json json_of(const marrow::Scene::Model& model) {
  check_mesh(model.mesh, "model '" + model.name + "' of a scene");
  std::vector<float> vertices;
  for (const Eigen::Vector3d& vertex : model.mesh.vertices_mm)
    for (int k = 0; k < 3; ++k) vertices.push_back(float(vertex[k]));
  std::vector<std::uint32_t> triangles;
  for (const auto& triangle : model.mesh.triangles) triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  return {{"name", model.name}, {"vertices", encoded(vertices)}, {"triangles", encoded(triangles)}};
}

ordered_json json_of(const marrow::Scene::Backdrop& view) {
  const cv::Mat pixels = view.picture.pixels.isContinuous() ? view.picture.pixels : view.picture.pixels.clone();
  if (pixels.depth() != CV_8U || (pixels.channels() != 1 && pixels.channels() != 3))
    throw marrow::Error("view '" + view.name + "' of a scene: expected a picture of 8 bits in one or three channels");
  const std::string png =
      marrow::files::png_of(pixels.cols, pixels.rows, pixels.channels(), marrow::files::Sample::u8, pixels.data);
  return {{"name", view.name},
          {"width_px", view.camera.width_px},
          {"height_px", view.camera.height_px},
          {"intrinsics", rows(view.camera.intrinsics)},
          {"camera_from_world", rows(view.camera.camera_from_world)},
          {"image", "data:image/png;base64," + marrow::base64(png)}};
}

void scene(const marrow::Scene& scene, const std::string& path) {
  ordered_json json = {{"marrow-scene", 1},
                       {"meshes", ordered_json::array()},
                       {"poses", ordered_json::array()},
                       {"views", ordered_json::array()}};
  for (const auto& model : scene.models) json["meshes"].push_back(json_of(model));
  for (const auto& placement : scene.placements) {
    check_rigid(placement.world_from_model, "pose '" + placement.name + "' of a scene");
    for (std::size_t i = 0; i < scene.models.size(); ++i)
      if (scene.models[i].name == placement.model)
        json["poses"].push_back(
            {{"mesh", i}, {"name", placement.name}, {"world_from_model", rows(placement.world_from_model)}});
  }
  for (const auto& view : scene.views) json["views"].push_back(json_of(view));
  marrow::write::write_json(path, json, -1);
}

void landscape(const marrow::Landscape& landscape, const std::string& path) {
  ordered_json json = {{"marrow-landscape", 1}, {"profiles", ordered_json::array()}};
  for (const auto& profile : landscape.profiles) {
    ordered_json one = {
        {"axis", profile.axis}, {"unit", profile.unit}, {"offsets", profile.offsets}, {"costs", ordered_json::array()}};
    for (const double cost : profile.costs)
      one["costs"].push_back(std::isfinite(cost) ? ordered_json(cost) : ordered_json());
    if (profile.truth) one["truth"] = *profile.truth;
    json["profiles"].push_back(one);
  }
  marrow::write::write_json(path, json, -1);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::Scene>(".json", scene, "models, poses, cameras and images of a 3D view");
  plugin.writer<marrow::Landscape>(".json", landscape, "profiles of the cost along each of the six axes");
}
