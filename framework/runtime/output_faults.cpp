// SPDX-License-Identifier: Apache-2.0
#include "output_faults.hpp"

#include <algorithm>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/error.hpp"
#include "marrow/domain/mesh.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/runtime/types.hpp"

namespace marrow {
namespace {

std::string fault_of_grid(const Grid& grid, std::size_t values) {
  const bool is_possible = std::all_of(grid.size.begin(), grid.size.end(), [](int size) { return size >= 0; });
  if (is_possible && values == grid.count()) return "";
  return "its grid has " + std::to_string(grid.size[0]) + " x " + std::to_string(grid.size[1]) + " x " +
         std::to_string(grid.size[2]) + " voxels, but there are " + std::to_string(values) + " values";
}

std::string fault_of_mesh(const Mesh& mesh) {
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= mesh.vertices_mm.size())
        return "a triangle has the vertex " + std::to_string(vertex) + ", but there are " +
               std::to_string(mesh.vertices_mm.size()) + " vertices, counted from 0";
  return "";
}

std::string fault_of_view(const View& view) {
  if (view.mask.empty() || view.mask.size() == view.image.pixels.size()) return "";
  return "its mask has " + std::to_string(view.mask.cols) + " x " + std::to_string(view.mask.rows) +
         " pixels, its image " + std::to_string(view.image.pixels.cols) + " x " +
         std::to_string(view.image.pixels.rows);
}

std::string fault_of_pose(const Pose& pose) {
  try {
    check_pose(pose, "the pose");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

std::string fault_of_value(const Value& value) {
  if (!value.data) return "";
  if (value.type == TypeInfo::of<Volume>()) {
    const auto& volume = value.as<Volume>();
    return fault_of_grid(volume.grid, volume.values.size());
  }
  if (value.type == TypeInfo::of<SignedField>()) {
    const auto& field = value.as<SignedField>();
    return fault_of_grid(field.grid, field.values_mm.size());
  }
  if (value.type == TypeInfo::of<Mesh>()) return fault_of_mesh(value.as<Mesh>());
  if (value.type == TypeInfo::of<View>()) return fault_of_view(value.as<View>());
  if (value.type == TypeInfo::of<Pose>()) return fault_of_pose(value.as<Pose>());
  return "";
}

}  // namespace marrow
