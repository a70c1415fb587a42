// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/mesh_file.hpp"

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestMeshFile = std::uint64_t(4) << 30;

}  // namespace

void SpaceMark::look_into(std::string_view comment) {
  constexpr std::string_view kMark = "SPACE=";
  for (std::size_t at = comment.find(kMark); at != std::string_view::npos; at = comment.find(kMark, at + 1)) {
    const std::string_view name = comment.substr(at + kMark.size(), 3);
    const Space found = name == "RAS" ? Space::ras : name == "LPS" ? Space::lps : Space::unknown;
    if (found == Space::unknown) continue;
    if (first_ == Space::unknown) first_ = found;
    if (first_ != found) is_contradicted_ = true;
  }
}

MarkedMesh read_marked_mesh(const std::filesystem::path& path) {
  const std::string what = path.string();
  const std::string extension = extension_of(path);
  if (extension != ".stl" && extension != ".ply")
    throw Error(what + ": not a surface that can be read; known are .stl and .ply");
  std::string bytes = read_bytes(path, kLargestMeshFile);
  return extension == ".stl" ? read_stl(std::move(bytes), what) : read_ply(std::move(bytes), what);
}

Mesh in_lps_mm(MarkedMesh marked, double scale, const std::string& what) {
  for (Eigen::Vector3d& vertex : marked.mesh.vertices_mm) {
    if (marked.space.is_ras()) vertex.head<2>() *= -1;
    vertex *= scale;
  }
  check_mesh(marked.mesh, what);
  return std::move(marked.mesh);
}

Mesh read_mesh_file(const std::filesystem::path& path, double scale) {
  return in_lps_mm(read_marked_mesh(path), scale, path.string());
}

}  // namespace marrow::files
