// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: lines "v x y z" and "f 1 2 3". Of a corner "7/2/5" the first number names the vertex. Numbers begin at
// 1; negative ones count back from the last vertex. Normals, textures, groups and materials are passed over. A line of
// numbers that ends with \ continues in the next one.
#include <algorithm>
#include <charconv>
#include <string_view>

#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/toolbox/exchange/surface_file.hpp"
#include "marrow/toolbox/files/input_file.hpp"
#include "marrow/toolbox/files/yaml_text.hpp"

namespace marrow::exchange {
namespace {

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& path) : what_(path.string()) {}

  FilePolygons read(std::string_view text) {
    while (!text.empty()) {
      line_ += lines_read_;
      lines_read_ = 0;
      read_line(next_line(text));
    }
    if (result_.polygons.corner_counts.empty())
      throw Error(what_ + ": there is no face ('f 1 2 3') in it; it is cut off, or no OBJ");
    return std::move(result_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const { throw Error(formatted("{}:{}: {}", what_, line_, what)); }
  static std::string shown(std::string_view word) { return in_quotes(printable(word.substr(0, 40))); }

  /// The next line with those that continue it. A comment or a name may end with \ as well, as a folder's name does.
  std::string_view next_line(std::string_view& text) {
    static constexpr std::string_view kNumbers[] = {"v", "f", "l", "p", "vn", "vt", "vp"};
    std::string_view line = taken_line(text), rest = line;
    if (std::find(std::begin(kNumbers), std::end(kNumbers), next_word(rest)) == std::end(kNumbers)) return line;
    if (!line.ends_with('\\')) return line;
    joined_.clear();
    for (; line.ends_with('\\') && !text.empty(); line = taken_line(text))
      joined_ += std::string(line.substr(0, line.size() - 1)) + " ";
    return joined_ += line;
  }
  /// A line without blanks at its end, taken from the text.
  std::string_view taken_line(std::string_view& text) {
    ++lines_read_;
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    while (line.ends_with(' ') || line.ends_with('\t')) line.remove_suffix(1);
    return line;
  }

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
      result_.space.look_into(line);
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
    rest = rest.substr(0, rest.find('#'));
    for (std::string_view word = next_word(rest); !word.empty(); word = next_word(rest)) {
      const std::string_view number = word.substr(0, word.find('/'));
      long long index = 0;
      const auto [end, failure] = std::from_chars(number.data(), number.data() + number.size(), index);
      if (failure != std::errc() || end != number.data() + number.size())
        refuse("expected the numbers of vertices, got " + shown(word));
      const long long known = (long long)(points.size());
      if (index == 0 || index > known || index < -known)
        refuse(formatted("the face names vertex {}; there are {} before it, counted from 1", index, known));
      corners.push_back(std::uint32_t(index > 0 ? index - 1 : known + index));
      ++count;
    }
    if (count < 3) refuse(formatted("a face needs at least 3 vertices, got {}", count));
    counts.push_back(count);
  }

  std::string what_;
  std::size_t line_ = 1, lines_read_ = 0;  ///< the first line of the one that is read, and how many there are
  std::string joined_;
  FilePolygons result_;
};

}  // namespace

FilePolygons read_obj(const std::filesystem::path& path) {
  return ObjReader(path).read(files::read_text(path, kMostSurfaceBytes));
}

std::string obj_text(const Mesh& mesh) {
  check_mesh(mesh, "the surface cannot be written as .obj");
  std::string text = "# marrow, mm, SPACE=LPS, frame " + printable(mesh.frame) + "\n";
  for (const Eigen::Vector3d& vertex : mesh.vertices_mm) {
    text += "v";
    for (const double coordinate : vertex) text += " " + files::number(coordinate);
    text += "\n";
  }
  for (const auto& triangle : mesh.triangles) {
    text += "f";
    for (const std::uint32_t corner : triangle) text += formatted(" {}", corner + 1);
    text += "\n";
  }
  return text;
}

}  // namespace marrow::exchange
