// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/mesh_file.hpp"

#include <cstring>

#include "marrow/domain/error.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

static_assert(std::endian::native == std::endian::little, "the readers below take little-endian numbers as they are");

constexpr std::uint64_t kLargestFile = std::uint64_t(4) << 30;

Mesh read_stl_binary(const std::string& bytes, const std::string& what) {
  constexpr std::size_t kHeader = 84, kFacet = 50;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  if (bytes.size() < kHeader + std::size_t(count) * kFacet)
    throw Error(what + ": its header claims " + std::to_string(count) + " triangles, but the file has room for " +
                std::to_string((bytes.size() - kHeader) / kFacet) + "; it is cut off, or no STL");
  if (bytes.size() > kHeader + std::size_t(count) * kFacet)
    throw Error(what + ": its header claims " + std::to_string(count) + " triangles, which end after " +
                std::to_string(kHeader + std::size_t(count) * kFacet) + " bytes, but the file has " +
                std::to_string(bytes.size()) + "; it is damaged: export it again");
  MeshBuilder builder(count);
  for (std::size_t i = 0; i < count; ++i) {
    float numbers[9];
    std::memcpy(numbers, bytes.data() + kHeader + i * kFacet + 12, sizeof numbers);
    std::array<std::uint32_t, 3> corner;
    for (int k = 0; k < 3; ++k) corner[k] = builder.vertex({numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]});
    builder.triangle(corner[0], corner[1], corner[2]);
  }
  return std::move(builder.mesh);
}

Mesh read_stl_text(const std::string& bytes, const std::string& what) {
  Words words(bytes);
  words.skip_line();  // solid NAME
  MeshBuilder builder(bytes.size() / 250);
  std::array<std::uint32_t, 3> corner{};
  int corners = 0;
  bool ended = false, in_facet = false;  // since the last endsolid; a file may hold several solids
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (ended != (word == "solid"))
      throw Error(what +
                  (ended ? ": after 'endsolid' comes neither its end nor another 'solid'"
                         : ": a 'solid' begins before the 'endsolid' of the one before") +
                  "; the file is cut off or damaged");
    if (ended) {
      words.skip_line();
      ended = false;
    } else if (word == "facet") {
      if (in_facet) throw Error(what + ": a facet begins inside another; the file is cut off or damaged");
      in_facet = true;
    } else if (word == "vertex") {
      const auto x = words.number(), y = words.number(), z = words.number();
      if (!x || !y || !z || corners == 3 || !in_facet)
        throw Error(what + ": a facet is not three lines 'vertex x y z'; the file is cut off or damaged");
      corner[std::size_t(corners++)] = builder.vertex({*x, *y, *z});
    } else if (word == "endfacet") {
      if (corners != 3) throw Error(what + ": a facet has " + std::to_string(corners) + " vertices; expected 3");
      builder.triangle(corner[0], corner[1], corner[2]);
      corners = 0;
      in_facet = false;
    } else if (word == "endsolid") {
      if (in_facet || corners != 0)
        throw Error(what + ": its last facet before 'endsolid' has no 'endfacet'; the file is cut off or damaged");
      words.skip_line();
      ended = true;
    }
  }
  if (!ended) throw Error(what + ": 'endsolid' is missing at its end; the file is cut off, or no STL");
  return std::move(builder.mesh);
}

Mesh read_stl(const std::string& bytes, const std::string& what) {
  // Some programs begin a binary file with the word "solid", so the size decides whether it is binary.
  if (bytes.size() >= 84) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, sizeof count);
    if (bytes.size() == 84 + std::size_t(count) * 50) return read_stl_binary(bytes, what);
  }
  if (bytes.rfind("solid", 0) == 0) return read_stl_text(bytes, what);
  if (bytes.size() < 84) throw Error(what + ": is too short for an STL file; it is cut off, or no STL");
  return read_stl_binary(bytes, what);
}

}  // namespace

Mesh read_mesh_file(const std::filesystem::path& path, double scale) {
  const std::string what = path.string();
  std::string extension = path.extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".stl" && extension != ".ply")
    throw Error(what + ": not a surface that can be read; known are .stl and .ply");
  const std::string bytes = read_bytes(path, kLargestFile);
  Mesh mesh = extension == ".stl" ? read_stl(bytes, what) : read_ply(bytes, what);
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex *= scale;
  check_mesh(mesh, what);
  return mesh;
}

}  // namespace marrow::files
