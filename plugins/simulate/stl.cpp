// SPDX-License-Identifier: Apache-2.0
#include "stl.hpp"

#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "marrow/domain/error.hpp"

namespace marrow::simulate {
namespace {

constexpr std::size_t kHeader = 84, kTriangle = 50;

class Welder {
 public:
  void add(const std::array<std::array<float, 3>, 3>& corners) {
    std::array<std::uint32_t, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [at, is_new] = index_.try_emplace(corners[k], std::uint32_t(mesh.vertices_mm.size()));
      if (is_new) mesh.vertices_mm.emplace_back(corners[k][0], corners[k][1], corners[k][2]);
      triangle[k] = at->second;
    }
    if (triangle[0] != triangle[1] && triangle[1] != triangle[2] && triangle[2] != triangle[0])
      mesh.triangles.push_back(triangle);
  }
  Mesh mesh;

 private:
  std::map<std::array<float, 3>, std::uint32_t> index_;
};

void read_ascii(const std::string& content, const std::string& name, Welder& welder) {
  std::istringstream words(content);
  std::array<std::array<float, 3>, 3> corners;
  std::size_t corner = 0;
  for (std::string word; words >> word;) {
    if (word != "vertex") continue;
    auto& place = corners[corner];
    if (!(words >> place[0] >> place[1] >> place[2]))
      throw Error(name + ": a 'vertex' is not followed by three numbers");
    if (!std::isfinite(place[0]) || !std::isfinite(place[1]) || !std::isfinite(place[2]))
      throw Error(name + ": a 'vertex' is not followed by three finite numbers");
    if (++corner == 3) {
      welder.add(corners);
      corner = 0;
    }
  }
  if (corner != 0) throw Error(name + ": the file ends within a triangle");
}

}  // namespace

Mesh read_stl(const std::filesystem::path& path) {
  const std::string name = "surface file " + path.string();
  // A pipe would be waited for, a device read for ever.
  std::error_code failure;
  std::ifstream file;
  if (std::filesystem::is_regular_file(path, failure)) file.open(path, std::ios::binary);
  if (!file.is_open()) throw Error(name + ": cannot be read; give the path of an STL file");
  const std::string content((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());
  Welder welder;
  std::uint32_t count = 0;
  if (content.size() >= kHeader) std::memcpy(&count, content.data() + 80, 4);
  if (content.size() >= kHeader && content.size() == kHeader + kTriangle * std::size_t(count)) {
    for (std::size_t i = 0; i < count; ++i) {
      std::array<std::array<float, 3>, 3> corners;
      std::memcpy(corners.data(), content.data() + kHeader + kTriangle * i + 12, sizeof corners);
      welder.add(corners);
    }
  } else if (content.starts_with("solid")) {
    read_ascii(content, name, welder);
  } else {
    throw Error(name + ": neither a binary STL (" + std::to_string(content.size()) +
                " bytes, but its header promises " + std::to_string(count) + " triangles, which take " +
                std::to_string(kHeader + kTriangle * std::size_t(count)) +
                ") nor an ASCII one; the file may be truncated");
  }
  check_mesh(welder.mesh, name);
  return std::move(welder.mesh);
}

}  // namespace marrow::simulate
