// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/mesh_file.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLargestMeshFile = std::uint64_t(4) << 30;

constexpr std::size_t kMostStarts = 64;  // for a fan: no program makes faces of more corners that are not convex

/// Whether a fan of triangles from one corner covers the face exactly once: all triangles face the same side, and the
/// fan turns less than once around that corner.
bool is_covered_from(std::size_t start, const std::vector<Eigen::Vector3d>& corners) {
  const std::size_t count = corners.size();
  Eigen::Vector3d all = Eigen::Vector3d::Zero();
  const auto edges = [&](std::size_t i) {
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>{corners[(start + i) % count] - corners[start],
                                                       corners[(start + i + 1) % count] - corners[start]};
  };
  for (std::size_t i = 1; i + 1 < count; ++i) all += edges(i).first.cross(edges(i).second);
  double size = 0, turned = 0;
  for (std::size_t i = 1; i + 1 < count; ++i) {
    const auto [from, to] = edges(i);
    const Eigen::Vector3d normal = from.cross(to);
    if (normal.dot(all) < -1e-3 * all.squaredNorm()) return false;  // more than the rounding of a straight corner
    size += normal.norm();
    turned += std::atan2(normal.norm(), from.dot(to));
  }
  return !(size > 2 * all.norm()) && !(turned > 6.2832);
}

/// The corner from which a face of more than three corners is cut into a fan of triangles. Throws Error if there is
/// none.
std::size_t start_of_fan(const std::vector<std::uint32_t>& polygon, const MeshBuilder& builder,
                         const std::string& what) {
  std::vector<Eigen::Vector3d> corners;
  for (const std::uint32_t vertex : polygon) corners.push_back(builder.mesh.vertices_mm[vertex]);
  for (std::size_t start = 0; start < std::min(polygon.size(), kMostStarts); ++start) {
    if (is_covered_from(start, corners)) return start;
    if (polygon.size() > kMostStarts) break;
  }
  throw Error(
      formatted("{}: a face of {} corners is far from convex or flat, or crosses itself, so its triangles are not "
                "certain; save the surface as triangles",
                what, polygon.size()));
}

static_assert(std::endian::native == std::endian::little, "the reader takes little-endian numbers as they are");

constexpr std::size_t kStlComment = 80, kStlHeader = 84, kStlFacet = 50;

/// The number of triangles that a binary file claims to have.
std::uint32_t claimed_facets(const std::string& bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kStlComment, sizeof count);
  return count;
}

MarkedMesh read_stl_binary(const std::string& bytes, const std::string& what) {
  const std::uint32_t count = claimed_facets(bytes);
  if (bytes.size() < kStlHeader + std::size_t(count) * kStlFacet)
    throw Error(formatted("{}: its header claims {} triangles, but the file has room for {}; it is cut off, or no STL",
                          what, count, (bytes.size() - kStlHeader) / kStlFacet));
  if (bytes.size() > kStlHeader + std::size_t(count) * kStlFacet)
    throw Error(
        formatted("{}: its header claims {} triangles, which end after {} bytes, but the file has {}; it is damaged: "
                  "export it again",
                  what, count, kStlHeader + std::size_t(count) * kStlFacet, bytes.size()));
  MeshBuilder builder(count);
  for (std::size_t i = 0; i < count; ++i) {
    float numbers[9];
    std::memcpy(numbers, bytes.data() + kStlHeader + i * kStlFacet + 12, sizeof numbers);
    std::array<std::uint32_t, 3> corner;
    for (int k = 0; k < 3; ++k) corner[k] = builder.vertex({numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]});
    builder.triangle(corner[0], corner[1], corner[2]);
  }
  MarkedMesh read{std::move(builder.mesh), {}};
  read.space.look_into(std::string_view(bytes).substr(0, kStlComment));
  return read;
}

/// Whether this is a keyword of STL, which some programs write in capital letters.
bool is_keyword(std::string_view word, std::string_view keyword) {
  const auto is_same = [](char c, char small) { return (c >= 'A' && c <= 'Z' ? c - 'A' + 'a' : c) == small; };
  return std::equal(word.begin(), word.end(), keyword.begin(), keyword.end(), is_same);
}

/// Where the first line 'solid NAME' begins. Empty lines and a title may stand before it. Nothing if there is none in
/// the text at the file's beginning.
std::optional<std::size_t> begin_of_solid(std::string_view text) {
  constexpr std::size_t kMostTitle = 4096;
  for (std::size_t at = 0; at < std::min(text.size(), kMostTitle);) {
    const std::string_view line = text.substr(at, text.find('\n', at) - at);
    if (is_keyword(Words(line).next(), "solid")) return at;
    if (line.find('\0') != std::string_view::npos) return std::nullopt;  // this is no text
    at += line.size() + 1;
  }
  return std::nullopt;
}

/// `text` begins with 'solid'.
MarkedMesh read_stl_text(std::string_view text, const std::string& what, SpaceMark space) {
  Words words(text);
  MeshBuilder builder(text.size() / 250);
  std::array<std::uint32_t, 3> corner{};
  int corners = 0;
  bool ended = true, in_facet = false;  // ended: outside of a solid; a file may hold several
  for (std::string_view word = words.next(); !word.empty(); word = words.next()) {
    if (ended != is_keyword(word, "solid"))
      throw Error(what +
                  (ended ? ": after 'endsolid' comes neither its end nor another 'solid'"
                         : ": a 'solid' begins before the 'endsolid' of the one before") +
                  "; the file is cut off or damaged");
    if (ended) {
      space.look_into(words.rest_of_line());
      ended = false;
    } else if (is_keyword(word, "facet")) {
      if (in_facet) throw Error(what + ": a facet begins inside another; the file is cut off or damaged");
      in_facet = true;
    } else if (is_keyword(word, "vertex")) {
      const auto x = words.number(), y = words.number(), z = words.number();
      if (!x || !y || !z || corners == 3 || !in_facet)
        throw Error(what + ": a facet is not three lines 'vertex x y z'; the file is cut off or damaged");
      corner[std::size_t(corners++)] = builder.vertex({*x, *y, *z});
    } else if (is_keyword(word, "endfacet")) {
      if (corners != 3) throw Error(formatted("{}: a facet has {} vertices; expected 3", what, corners));
      builder.triangle(corner[0], corner[1], corner[2]);
      corners = 0;
      in_facet = false;
    } else if (is_keyword(word, "endsolid")) {
      if (in_facet || corners != 0)
        throw Error(what + ": its last facet before 'endsolid' has no 'endfacet'; the file is cut off or damaged");
      words.rest_of_line();
      ended = true;
    }
  }
  if (!ended) throw Error(what + ": 'endsolid' is missing at its end; the file is cut off, or no STL");
  return {std::move(builder.mesh), space};
}

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

void add_polygon(const std::vector<std::uint32_t>& polygon, MeshBuilder& builder, const std::string& what) {
  const std::size_t count = polygon.size(), start = count > 3 ? start_of_fan(polygon, builder, what) : 0;
  for (std::size_t i = 1; i + 1 < count; ++i)
    builder.triangle(polygon[start], polygon[(start + i) % count], polygon[(start + i + 1) % count]);
}

Mesh mesh_of(const Polygons& polygons, const std::string& what) {
  MeshBuilder builder(polygons.corner_counts.size());
  std::vector<std::uint32_t> index;
  index.reserve(polygons.points_mm.size());
  for (const Eigen::Vector3d& point : polygons.points_mm) index.push_back(builder.vertex(point));
  std::size_t at = 0;
  std::vector<std::uint32_t> face;
  for (const std::uint32_t count : polygons.corner_counts) {
    face.clear();
    for (std::uint32_t i = 0; i < count; ++i) face.push_back(index[polygons.corners[at++]]);
    add_polygon(face, builder, what);
  }
  return std::move(builder.mesh);
}

// STL as binary and as text. Its 80 bytes of header, or the names of its solids, may hold a mark of the coordinates.

MarkedMesh read_stl(std::string bytes, const std::string& what) {
  // Some programs begin a binary file with the word "solid", so the size decides whether it is binary.
  if (bytes.size() >= kStlHeader && bytes.size() == kStlHeader + std::size_t(claimed_facets(bytes)) * kStlFacet)
    return read_stl_binary(bytes, what);
  if (begin_of_solid(plain_text(bytes.substr(0, 4096)))) {
    const std::string text = plain_text(std::move(bytes));
    const std::size_t begin = begin_of_solid(text).value();
    SpaceMark space;
    space.look_into(std::string_view(text).substr(0, begin));
    return read_stl_text(std::string_view(text).substr(begin), what, space);
  }
  if (bytes.size() < kStlHeader) throw Error(what + ": is too short for an STL file; it is cut off, or no STL");
  return read_stl_binary(bytes, what);
}

}  // namespace marrow::files
