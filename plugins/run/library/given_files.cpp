// SPDX-License-Identifier: Apache-2.0
#include "marrow/run/given_files.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/run/metrics_file.hpp"
#include "marrow/run/volume_out.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/toolbox/files/samples_out.hpp"

namespace marrow::run {
namespace {

namespace fs = std::filesystem;

const std::map<std::string, std::vector<std::string>>& formats() {
  static const std::map<std::string, std::vector<std::string>> all{
      {"volume", formats_of_volumes()}, {"second_volume", formats_of_volumes()},
      {"field", formats_of_volumes()},  {"mesh", {"stl", "ply", "obj", "vtp"}},
      {"image", {"png", "tif"}},        {"metrics", {"json"}}};
  return all;
}

template <class T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

void write_field(const SignedField& field, const std::string& format, const fs::path& file) {
  std::vector<std::uint8_t> inside(field.values_mm.size());
  std::transform(field.values_mm.begin(), field.values_mm.end(), inside.begin(),
                 [](float distance_mm) { return std::uint8_t(distance_mm < 0); });
  write_volume(file, format, field.grid, inside);
}

void write_mesh(const Mesh& mesh, const std::string& format, const fs::path& file) {
  check_mesh(mesh, "input 'mesh'");
  files::write_plainly(file, {format == "stl"   ? stl_bytes(mesh)
                              : format == "ply" ? ply_bytes(mesh)
                              : format == "obj" ? exchange::obj_text(mesh)
                                                : exchange::vtp_bytes(mesh)});
}

void write_image(const Image& image, const std::string& format, const fs::path& file) {
  const cv::Mat pixels = image.pixels.clone();  // rows without gaps
  if (format == "tif") {
    cv::Mat values;
    pixels.convertTo(values, CV_32F);
    return files::write_float_tiff(file, values.cols, values.rows, values.ptr<float>());
  }
  if (pixels.depth() == CV_32F)
    throw Error(
        "input 'image' has grey values that are no whole numbers, and PNG has no place for them; write "
        "{image.tif}");
  files::write_png(file, pixels.cols, pixels.rows, 1, pixels.depth() == CV_8U ? files::Sample::u8 : files::Sample::u16,
                   pixels.data);
}

}  // namespace

std::vector<std::string> names_of_inputs() { return {"volume", "second_volume", "field", "mesh", "image", "metrics"}; }

std::vector<std::string> formats_of_input(const std::string& name) { return formats().at(name); }

bool is_given(const GivenInputs& inputs, const std::string& name) {
  const void* input = name == "volume"          ? static_cast<const void*>(inputs.volume)
                      : name == "second_volume" ? inputs.second_volume
                      : name == "field"         ? inputs.field
                      : name == "mesh"          ? inputs.mesh
                      : name == "image"         ? inputs.image
                                                : static_cast<const void*>(inputs.metrics);
  return input != nullptr;
}

void write_input(const GivenInputs& inputs, const std::string& name, const std::string& format, const fs::path& file) {
  if (name == "volume") write_volume(file, format, inputs.volume->grid, inputs.volume->values);
  if (name == "second_volume") write_volume(file, format, inputs.second_volume->grid, inputs.second_volume->values);
  if (name == "field") write_field(*inputs.field, format, file);
  if (name == "mesh") write_mesh(*inputs.mesh, format, file);
  if (name == "image") write_image(*inputs.image, format, file);
  if (name == "metrics") files::write_plainly(file, {metrics_text(*inputs.metrics)});
}

std::string stl_bytes(const Mesh& mesh) {
  std::string bytes(80, ' ');
  append(bytes, std::uint32_t(mesh.triangles.size()));
  bytes.reserve(84 + 50 * mesh.triangles.size());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d &a = mesh.vertices_mm[triangle[0]], &b = mesh.vertices_mm[triangle[1]],
                          &c = mesh.vertices_mm[triangle[2]];
    const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
    for (const Eigen::Vector3d& vector : {normal, a, b, c})
      for (const double part : vector) append(bytes, float(part));
    append(bytes, std::uint16_t(0));
  }
  return bytes;
}

std::string ply_bytes(const Mesh& mesh) {
  std::string bytes = formatted(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double "
      "z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices_mm.size(), mesh.triangles.size());
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm)
    for (const double coordinate : vertex) append(bytes, coordinate);
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t(3));
    for (const std::uint32_t corner : triangle) append(bytes, std::int32_t(corner));
  }
  return bytes;
}

}  // namespace marrow::run
