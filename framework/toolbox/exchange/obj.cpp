// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: lines "v x y z" and "f 1 2 3". Of a corner "7/2/5" the first number names the vertex. Numbers begin at
// 1; negative ones count back from the last vertex. Normals, textures, groups and materials are passed over.
#include <algorithm>
#include <charconv>
#include <string_view>

#include "marrow/domain/error.hpp"
#include "marrow/domain/printable.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"
#include "polygons_file.hpp"

namespace marrow::exchange {
namespace {

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& path) : what_(path.string()) {}

  FilePolygons read(std::string_view text) {
    while (!text.empty()) {
      ++line_;
      const std::size_t end = std::min(text.find('\n'), text.size());
      read_line(text.substr(0, end));
      text.remove_prefix(std::min(end + 1, text.size()));
    }
    if (result_.polygons.corner_counts.empty())
      throw Error(what_ + ": there is no face ('f 1 2 3') in it; it is cut off, or no OBJ");
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw Error(what_ + ":" + std::to_string(line_) + ": " + what);
  }
  static std::string shown(std::string_view word) { return in_quotes(printable(word.substr(0, 40))); }

  static std::string_view next_word(std::string_view& text) {
    const auto is_space = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    while (!text.empty() && is_space(text.front())) text.remove_prefix(1);
    std::size_t end = 0;
    while (end < text.size() && !is_space(text[end])) ++end;
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(end);
    return word;
  }

  void read_line(std::string_view line) {
    std::string_view rest = line;
    const std::string_view key = next_word(rest);
    if (key.empty()) return;
    if (key[0] == '#') {
      if (line.find("SPACE=RAS") != std::string_view::npos) result_.is_ras = true;
    } else if (key == "v") {
      read_vertex(rest);
    } else if (key == "f") {
      read_face(rest);
    } else if (!is_passed_over(key)) {
      refuse("expected a line of an OBJ file, as 'v x y z' or 'f 1 2 3', got " + shown(line));
    }
  }

  static bool is_passed_over(std::string_view key) {
    static constexpr std::string_view kKeys[] = {"vn", "vt", "vp", "o", "g", "s", "l", "p", "mg", "usemtl", "mtllib"};
    return std::find(std::begin(kKeys), std::end(kKeys), key) != std::end(kKeys);
  }

  /// More numbers may follow: a weight or a colour.
  void read_vertex(std::string_view rest) {
    Eigen::Vector3d point;
    for (int i = 0; i < 3; ++i) {
      std::string_view word = next_word(rest);
      if (!word.empty() && word[0] == '+') word.remove_prefix(1);
      const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), point[i]);
      if (word.empty() || failure != std::errc() || end != word.data() + word.size())
        refuse("a vertex needs three numbers 'v x y z', got " + shown(word));
    }
    result_.polygons.points_mm.push_back(point);
  }

  void read_face(std::string_view rest) {
    auto& [points, corners, counts] = result_.polygons;
    std::uint32_t count = 0;
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
      const std::string_view number = word.substr(0, word.find('/'));
      long long index = 0;
      const auto [end, failure] = std::from_chars(number.data(), number.data() + number.size(), index);
      if (failure != std::errc() || end != number.data() + number.size())
        refuse("expected the numbers of vertices, got " + shown(word));
      const long long known = (long long)(points.size());
      if (index == 0 || index > known || index < -known)
        refuse("the face names vertex " + std::to_string(index) + "; there are " + std::to_string(known) +
               " before it, counted from 1");
      corners.push_back(std::uint32_t(index > 0 ? index - 1 : known + index));
      ++count;
    }
    if (count < 3) refuse("a face needs at least 3 vertices, got " + std::to_string(count));
    counts.push_back(count);
  }

  std::string what_;
  std::size_t line_ = 0;
  FilePolygons result_;
};

}  // namespace

FilePolygons read_obj(const std::filesystem::path& path) {
  return ObjReader(path).read(files::read_bytes(path, kMostSurfaceBytes));
}

std::string obj_text(const Mesh& mesh) {
  std::string text = "# marrow, mm, SPACE=LPS, frame " + printable(mesh.frame) + "\n";
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
    text += "v";
    for (const double coordinate : vertex) text += " " + files::number(coordinate);
    text += "\n";
  }
  for (const auto& triangle : mesh.triangles) {
    text += "f";
    for (const std::uint32_t corner : triangle) text += " " + std::to_string(corner + 1);
    text += "\n";
  }
  return text;
}

Mesh read_surface_file(const std::filesystem::path& path, double scale) {
  const std::string what = path.string();
  std::string end = path.extension().string();
  for (char& c : end) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (end == ".stl" || end == ".ply") return files::read_mesh_file(path, scale);
  if (end != ".obj" && end != ".vtp")
    throw Error(what + ": not a surface that can be read; known are .stl, .ply, .obj and .vtp");
  const FilePolygons file = end == ".obj" ? read_obj(path) : read_vtp(path);
  Mesh mesh = files::mesh_of(file.polygons, what);
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) {
    if (file.is_ras) vertex.head<2>() *= -1;
    vertex *= scale;
  }
  check_mesh(mesh, what);
  return mesh;
}

}  // namespace marrow::exchange
