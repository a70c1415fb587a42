// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cstring>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"

namespace {

static_assert(std::endian::native == std::endian::little, "the file says that its numbers are little-endian");

template <class T>
void append(std::string& bytes, const T& value) {
  const char* first = reinterpret_cast<const char*>(&value);
  bytes.append(first, sizeof value);
}

/// A name for one line of the header. A line break in the name would start another line.
std::string in_one_line(std::string name) {
  for (char& c : name)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  return name;
}

/// Binary PLY with double coordinates, so that reading gives exactly the same numbers.
void mesh(const marrow::Mesh& mesh, const std::string& path) {
  marrow::check_mesh(mesh, path);
  std::string bytes = marrow::formatted(
      "ply\nformat binary_little_endian 1.0\ncomment marrow, mm, frame {}\nelement vertex {}\nproperty double "
      "x\nproperty double y\nproperty double z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      in_one_line(mesh.frame), mesh.vertices_mm.size(), mesh.triangles.size());
  bytes.reserve(bytes.size() + mesh.vertices_mm.size() * 24 + mesh.triangles.size() * 13);
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm)
    for (const double coordinate : vertex) append(bytes, coordinate);
  for (const auto& triangle : mesh.triangles) {
    append(bytes, std::uint8_t(3));
    for (const std::uint32_t corner : triangle) append(bytes, std::int32_t(corner));
  }
  marrow::files::write_text(path, bytes);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::Mesh>(".ply", mesh, "PLY surface in mm (can be opened with MeshLab, Slicer, Blender)");
}
