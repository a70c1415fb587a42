// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/run/output_faults.hpp"

#include "marrow/base/number_text.hpp"
#include "marrow/runtime/node/types.hpp"

namespace marrow {
namespace {

std::string fault_of_grid(const Grid& grid, std::size_t values) {
  const bool is_possible = std::all_of(grid.size.begin(), grid.size.end(), [](int size) { return size >= 0; });
  if (is_possible && values == grid.count()) return "";
  return formatted("its grid has {} x {} x {} voxels, but there are {} values", grid.size[0], grid.size[1],
                   grid.size[2], values);
}

std::string fault_of_mesh(const Mesh& mesh) {
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t vertex : triangle)
      if (vertex >= mesh.vertices_mm.size())
        return formatted("a triangle has the vertex {}, but there are {} vertices, counted from 0", vertex,
                         mesh.vertices_mm.size());
  return "";
}

std::string fault_of_view(const View& view) {
  if (view.mask.empty() || view.mask.size() == view.image.pixels.size()) return "";
  return formatted("its mask has {} x {} pixels, its image {} x {}", view.mask.cols, view.mask.rows,
                   view.image.pixels.cols, view.image.pixels.rows);
}

std::string fault_of_pose(const Pose& pose) {
  try {
    check_pose(pose, "the pose");
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

/// Whether a pattern, in which * stands for any text, describes the whole text.
bool fits(std::string_view pattern, std::string_view text) {
  if (pattern.empty()) return text.empty();
  if (pattern[0] != '*') return !text.empty() && pattern[0] == text[0] && fits(pattern.substr(1), text.substr(1));
  for (std::size_t skipped = 0; skipped <= text.size(); ++skipped)
    if (fits(pattern.substr(1), text.substr(skipped))) return true;
  return false;
}

}  // namespace

bool may_have_figure(const PortInfo& port, const std::string& name) {
  return port.figures.empty() || std::any_of(port.figures.begin(), port.figures.end(),
                                             [&](const std::string& pattern) { return fits(pattern, name); });
}

std::string fault_of_figures(const PortInfo& port, const Value& value) {
  if (!value.data || port.figures.empty() || value.type != TypeInfo::of<Metrics>()) return "";
  for (const Metric& metric : value.as<Metrics>().items)
    if (!may_have_figure(port, metric.name))
      return "the figure '" + metric.name + "' is not among those that its declaration names";
  return "";
}

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
