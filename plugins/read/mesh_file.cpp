// SPDX-License-Identifier: Apache-2.0
#include "mesh_file.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>
#include <unordered_map>

#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

static_assert(std::endian::native == std::endian::little, "the readers below take little-endian numbers as they are");

std::string read_bytes(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::exists(path, failure)) throw Error(path.string() + ": there is no such file");
  if (!std::filesystem::is_regular_file(path, failure)) throw Error(path.string() + ": expected a file, this is none");
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(std::filesystem::file_size(path), '\0');
  if (!stream.read(bytes.data(), std::streamsize(bytes.size()))) throw Error(path.string() + ": cannot be read");
  if (bytes.empty()) throw Error(path.string() + ": the file is empty");
  return bytes;
}

/// Makes one vertex of all that have the same coordinates: STL repeats a vertex for each of its triangles.
class MeshBuilder {
 public:
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

Mesh read_stl_binary(const std::string& bytes, const std::string& what) {
  constexpr std::size_t kHeader = 84, kFacet = 50;
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  if (bytes.size() < kHeader + std::size_t(count) * kFacet)
    throw Error(what + ": its header claims " + std::to_string(count) + " triangles, but the file has room for " +
                std::to_string((bytes.size() - kHeader) / kFacet) + "; it is cut off, or no STL");
  MeshBuilder builder;
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
  std::istringstream stream(bytes);
  std::string word, line;
  std::getline(stream, line);  // solid NAME
  MeshBuilder builder;
  std::array<std::uint32_t, 3> corner{};
  int corners = 0;
  bool ended = false;
  while (stream >> word) {
    if (word == "vertex") {
      Eigen::Vector3d point;
      if (!(stream >> point.x() >> point.y() >> point.z()) || corners == 3)
        throw Error(what + ": a facet is not three lines 'vertex x y z'; the file is cut off or damaged");
      corner[std::size_t(corners++)] = builder.vertex(point);
    } else if (word == "endfacet") {
      if (corners != 3) throw Error(what + ": a facet has " + std::to_string(corners) + " vertices; expected 3");
      builder.triangle(corner[0], corner[1], corner[2]);
      corners = 0;
    } else if (word == "endsolid") {
      std::getline(stream, line);
      ended = true;
    }
  }
  if (!ended) throw Error(what + ": 'endsolid' is missing; the file is cut off, or no STL");
  return std::move(builder.mesh);
}

Mesh read_stl(const std::string& bytes, const std::string& what) {
  // Some programs begin a binary file with the word solid, so the size decides.
  if (bytes.size() >= 84) {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes.data() + 80, sizeof count);
    if (bytes.size() == 84 + std::size_t(count) * 50) return read_stl_binary(bytes, what);
  }
  if (bytes.rfind("solid", 0) == 0) return read_stl_text(bytes, what);
  if (bytes.size() < 84) throw Error(what + ": is too short for an STL file; it is cut off, or no STL");
  return read_stl_binary(bytes, what);
}

struct PlyProperty {
  std::string name, type, count_type;  ///< count_type: of a list
};
struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<PlyProperty> properties;
};

/// The numbers of a PLY body one after the other, as text or as bytes.
class PlyBody {
 public:
  PlyBody(std::string format, std::string_view bytes, std::string what)
      : format_(std::move(format)), bytes_(bytes), what_(std::move(what)) {}

  /// Throws Error where text is left over: then the header claims too little, or of the wrong kind.
  void finish() const {
    if (format_ == "ascii" && bytes_.find_first_not_of(" \t\r\n", at_) != std::string_view::npos)
      throw Error(what_ + ": has more numbers than its header claims; it is damaged");
  }

  double next(const std::string& type) {
    if (format_ == "ascii") return next_text();
    if (type == "float" || type == "float32") return take<float>();
    if (type == "double" || type == "float64") return take<double>();
    if (type == "uchar" || type == "uint8") return take<std::uint8_t>();
    if (type == "char" || type == "int8") return take<std::int8_t>();
    if (type == "ushort" || type == "uint16") return take<std::uint16_t>();
    if (type == "short" || type == "int16") return take<std::int16_t>();
    if (type == "uint" || type == "uint32") return take<std::uint32_t>();
    if (type == "int" || type == "int32") return take<std::int32_t>();
    throw Error(what_ + ": unknown PLY type '" + type + "'");
  }

 private:
  [[noreturn]] void cut_off() const {
    throw Error(what_ + ": has fewer numbers than its header claims; it is cut off or damaged");
  }
  double next_text() {
    while (at_ < bytes_.size() && std::isspace(static_cast<unsigned char>(bytes_[at_]))) ++at_;
    std::size_t end = at_;
    while (end < bytes_.size() && !std::isspace(static_cast<unsigned char>(bytes_[end]))) ++end;
    const std::string word(bytes_.substr(at_, end - at_));
    char* stop = nullptr;
    const double value = std::strtod(word.c_str(), &stop);
    if (word.empty() || *stop) cut_off();
    at_ = end;
    return value;
  }
  template <class T>
  double take() {
    if (bytes_.size() - at_ < sizeof(T)) cut_off();
    char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_, sizeof(T));
    if (format_ == "binary_big_endian") std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    at_ += sizeof(T);
    return double(value);
  }
  std::string format_;
  std::string_view bytes_;
  std::string what_;
  std::size_t at_ = 0;
};

struct PlyHeader {
  std::string format;
  std::vector<PlyElement> elements;
  std::size_t end = 0;  ///< where the body begins
};

PlyHeader read_ply_header(const std::string& bytes, const std::string& what) {
  PlyHeader header;
  std::size_t at = 0;
  for (int line_number = 1;; ++line_number) {
    const std::size_t end = bytes.find('\n', at);
    if (end == std::string::npos || end - at > 4096)
      throw Error(what + ": its header has no 'end_header'; it is cut off, or no PLY");
    std::istringstream line(bytes.substr(at, end - at));
    at = end + 1;
    std::string word;
    line >> word;
    if (line_number == 1 && word != "ply") throw Error(what + ": does not begin with 'ply'; it is no PLY file");
    if (word == "format") line >> header.format;
    if (word == "element") {
      PlyElement element;
      if (!(line >> element.name >> element.count))
        throw Error(what + ": line " + std::to_string(line_number) + ": expected 'element NAME COUNT'");
      // Every item takes at least one byte, which bounds what a damaged count can ask for.
      if (element.count > bytes.size())
        throw Error(what + ": its header claims " + std::to_string(element.count) + " of '" + element.name +
                    "', but the file has only " + std::to_string(bytes.size()) + " bytes");
      header.elements.push_back(element);
    }
    if (word == "property") {
      PlyProperty property;
      line >> property.type;
      if (property.type == "list") line >> property.count_type >> property.type;
      if (!(line >> property.name) || header.elements.empty())
        throw Error(what + ": line " + std::to_string(line_number) + ": expected 'property TYPE NAME'");
      header.elements.back().properties.push_back(property);
    }
    if (word == "end_header") break;
  }
  if (header.format != "ascii" && header.format != "binary_little_endian" && header.format != "binary_big_endian")
    throw Error(what + ": unknown PLY format '" + header.format + "'");
  header.end = at;
  return header;
}

void read_ply_vertex(const PlyElement& element, PlyBody& body, MeshBuilder& builder,
                     std::vector<std::uint32_t>& index) {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  for (const PlyProperty& property : element.properties) {
    if (!property.count_type.empty()) {
      for (double left = body.next(property.count_type); left > 0; --left) body.next(property.type);
      continue;
    }
    const double value = body.next(property.type);
    if (property.name == "x") point.x() = value;
    if (property.name == "y") point.y() = value;
    if (property.name == "z") point.z() = value;
  }
  index.push_back(builder.vertex(point));
}

void read_ply_face(const PlyElement& element, PlyBody& body, MeshBuilder& builder,
                   const std::vector<std::uint32_t>& index, const std::string& what) {
  for (const PlyProperty& property : element.properties) {
    if (property.count_type.empty()) {
      body.next(property.type);
      continue;
    }
    std::vector<std::uint32_t> corners;
    for (double left = body.next(property.count_type); left > 0; --left) {
      const double corner = body.next(property.type);
      if (property.name != "vertex_indices" && property.name != "vertex_index") continue;
      if (!(corner >= 0) || corner >= double(index.size()))
        throw Error(what + ": a face names vertex " + std::to_string(std::int64_t(corner)) + "; there are " +
                    std::to_string(index.size()));
      corners.push_back(index[std::size_t(corner)]);
    }
    for (std::size_t i = 2; i < corners.size(); ++i) builder.triangle(corners[0], corners[i - 1], corners[i]);
  }
}

Mesh read_ply(const std::string& bytes, const std::string& what) {
  const PlyHeader header = read_ply_header(bytes, what);
  PlyBody body(header.format, std::string_view(bytes).substr(header.end), what);
  MeshBuilder builder;
  std::vector<std::uint32_t> index;
  for (const PlyElement& element : header.elements)
    for (std::size_t i = 0; i < element.count; ++i) {
      if (element.name == "vertex")
        read_ply_vertex(element, body, builder, index);
      else
        read_ply_face(element, body, builder, element.name == "face" ? index : std::vector<std::uint32_t>(), what);
    }
  body.finish();
  return std::move(builder.mesh);
}

}  // namespace

Mesh read_mesh_file(const std::filesystem::path& path, double scale) {
  const std::string what = path.string();
  std::string extension = path.extension().string();
  for (char& c : extension) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".stl" && extension != ".ply")
    throw Error(what + ": not a surface that can be read; known are .stl and .ply");
  const std::string bytes = read_bytes(path);
  Mesh mesh = extension == ".stl" ? read_stl(bytes, what) : read_ply(bytes, what);
  for (Eigen::Vector3d& vertex : mesh.vertices_mm) vertex *= scale;
  check_mesh(mesh, what);
  return mesh;
}

}  // namespace marrow::read
