// SPDX-License-Identifier: Apache-2.0
#pragma once
// The common part of the readers of surfaces.
#include <array>
#include <bit>
#include <charconv>
#include <optional>
#include <string_view>
#include <unordered_map>

#include "marrow/toolbox/files/mesh_file.hpp"

namespace marrow::files {

/// Merges vertices with the same coordinates, because STL repeats a vertex for each of its triangles.
class MeshBuilder {
 public:
  explicit MeshBuilder(std::size_t triangles) {
    index_.reserve(triangles / 2);  // a closed surface has about half as many vertices
    mesh.triangles.reserve(triangles);
  }
  std::uint32_t vertex(const Eigen::Vector3d& point) {
    const Key key{bits(point.x()), bits(point.y()), bits(point.z())};
    const auto [found, is_new] = index_.try_emplace(key, std::uint32_t(mesh.vertices_mm.size()));
    if (is_new) mesh.vertices_mm.push_back(point);
    return found->second;
  }
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    if (a != b && b != c && c != a) mesh.triangles.push_back({a, b, c});
  }
  Mesh mesh;

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return key[0] * 0x9E3779B97F4A7C15ull ^ std::rotl(key[1] * 0xC2B2AE3D27D4EB4Full, 21) ^
             std::rotl(key[2] * 0x165667B19E3779F9ull, 42);
    }
  };
  static std::uint64_t bits(double value) { return std::bit_cast<std::uint64_t>(value + 0.0); }  // -0 counts as 0
  std::unordered_map<Key, std::uint32_t, Hash> index_;
};

/// The words of a text, one after the other.
class Words {
 public:
  explicit Words(std::string_view text) : text_(text) {}
  /// The next word; empty at the end.
  std::string_view next() {
    skip_space();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_space(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  /// The next word as a number. std::nullopt if it is none.
  std::optional<double> number() {
    std::string_view word = next();
    if (!word.empty() && word[0] == '+') word.remove_prefix(1);
    double value = 0;
    const auto [end, failure] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || failure != std::errc() || end != word.data() + word.size()) return std::nullopt;
    return value;
  }
  /// What is left of the line, and goes on after it.
  std::string_view rest_of_line() {
    const std::size_t begin = at_;
    at_ = std::min(text_.find('\n', at_), text_.size());
    return text_.substr(begin, at_ - begin);
  }
  bool is_at_end() {
    skip_space();
    return at_ == text_.size();
  }

 private:
  static bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
  void skip_space() {
    while (at_ < text_.size() && is_space(text_[at_])) ++at_;
  }
  std::string_view text_;
  std::size_t at_ = 0;
};

/// Adds a face as triangles, as a fan from one of its corners. Throws Error if no fan covers it exactly once.
void add_polygon(const std::vector<std::uint32_t>& polygon, MeshBuilder& builder, const std::string& what);

/// A surface from the bytes of an STL or PLY file. `what` names it in messages. Throw Error if it is damaged or not
/// supported.
MarkedMesh read_stl(std::string bytes, const std::string& what);
MarkedMesh read_ply(std::string bytes, const std::string& what);

}  // namespace marrow::files
