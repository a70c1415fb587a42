// SPDX-License-Identifier: Apache-2.0
// PLY as text or binary in either byte order. The file's size bounds all work, because each item takes at least one
// byte. Its comments may hold a mark of the coordinates.
#include <cmath>
#include <cstring>
#include <map>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

enum class Number { i8, u8, i16, u16, i32, u32, f32, f64 };
constexpr std::size_t kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};

struct Property {
  std::string name;
  Number type = Number::f32;
  std::optional<Number> count_type;  ///< only for a list: type of its length
};
struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};
enum class Format { text, little, big };

struct PlyHeader {
  Format format = Format::text;
  std::vector<Element> elements;
  SpaceMark space;
  std::size_t end = 0;  ///< offset of the body
};

class HeaderReader {
 public:
  HeaderReader(const std::string& bytes, const std::string& what) : bytes_(bytes), what_(what) {}

  PlyHeader read() {
    const std::size_t first_end = std::min(bytes_.find_first_of("\r\n"), bytes_.size());
    const char line_end =
        bytes_.compare(first_end, 1, "\r") == 0 && bytes_.compare(first_end, 2, "\r\n") != 0 ? '\r' : '\n';
    for (line_number_ = 1;; ++line_number_) {
      const std::size_t end = bytes_.find(line_end, header_.end);
      if (end == std::string::npos || end - header_.end > 4096 || line_number_ > 2000)
        throw Error(what_ + ": its header has no 'end_header'; it is cut off, or no PLY");
      Words line(std::string_view(bytes_).substr(header_.end, end - header_.end));
      header_.end = end + 1;
      const std::string_view word = line.next();
      if (line_number_ == 1 && word != "ply") throw Error(what_ + ": does not begin with 'ply'; it is no PLY file");
      if (word == "format") read_format(line);
      if (word == "comment") header_.space.look_into(line.rest_of_line());
      if (word == "element") read_element(line);
      if (word == "property") read_property(line);
      if (word == "end_header") break;
    }
    if (!has_format_) throw Error(what_ + ": unknown PLY format ''");
    for (const Element& element : header_.elements) check_claim(element);
    return std::move(header_);
  }

 private:
  [[noreturn]] void expected(const std::string& line) const {
    throw Error(formatted("{}: line {}: expected '{}'", what_, line_number_, line));
  }

  void read_format(Words& line) {
    static const std::map<std::string_view, Format> kFormats{
        {"ascii", Format::text}, {"binary_little_endian", Format::little}, {"binary_big_endian", Format::big}};
    const std::string_view name = line.next();
    const auto found = kFormats.find(name);
    if (found == kFormats.end() || has_format_)
      throw Error(what_ + ": unknown PLY format '" + std::string(name.substr(0, 40)) + "'");
    header_.format = found->second;
    has_format_ = true;
  }

  void read_element(Words& line) {
    Element element;
    element.name = line.next();
    const auto count = line.number();
    if (!count || !line.is_at_end() || !(*count >= 0) || *count != std::floor(*count) || *count > 1e18)
      expected("element NAME COUNT");
    element.count = std::size_t(*count);
    for (const Element& other : header_.elements)
      if (other.name == element.name)
        throw Error(what_ + ": its header gives the element '" + element.name + "' twice");
    header_.elements.push_back(element);
  }

  Number number(std::string_view name) const {
    static const std::map<std::string_view, Number> kNumbers{
        {"char", Number::i8},   {"int8", Number::i8},     {"uchar", Number::u8},   {"uint8", Number::u8},
        {"short", Number::i16}, {"int16", Number::i16},   {"ushort", Number::u16}, {"uint16", Number::u16},
        {"int", Number::i32},   {"int32", Number::i32},   {"uint", Number::u32},   {"uint32", Number::u32},
        {"float", Number::f32}, {"float32", Number::f32}, {"double", Number::f64}, {"float64", Number::f64}};
    const auto found = kNumbers.find(name);
    if (found == kNumbers.end()) throw Error(what_ + ": unknown PLY type '" + std::string(name.substr(0, 40)) + "'");
    return found->second;
  }

  void read_property(Words& line) {
    Property property;
    std::string_view type = line.next();
    if (type == "list") {
      property.count_type = number(line.next());
      if (*property.count_type == Number::f32 || *property.count_type == Number::f64)
        expected("property list WHOLE_NUMBER TYPE NAME");
      type = line.next();
    }
    if (type.empty() || header_.elements.empty()) expected("property TYPE NAME");
    property.type = number(type);
    property.name = line.next();
    if (property.name.empty() || !line.is_at_end()) expected("property TYPE NAME");
    for (const Property& other : header_.elements.back().properties)
      if (other.name == property.name)
        throw Error(what_ + ": its header gives the property '" + property.name + "' twice");
    header_.elements.back().properties.push_back(property);
  }

  /// Throws Error if the file is too small for the number of items that the element claims.
  void check_claim(const Element& element) const {
    std::size_t least = 0;  // bytes of an item with empty lists
    for (const Property& property : element.properties)
      least += header_.format == Format::text ? 1 : kBytes[int(property.count_type.value_or(property.type))];
    if (element.count > 0 && least == 0)
      throw Error(what_ + ": its element '" + element.name + "' has no property; it is damaged");
    if (element.count > 0 && element.count > (bytes_.size() - header_.end) / least)
      throw Error(formatted("{}: its header claims {} of '{}', but the file has only {} bytes", what_, element.count,
                            element.name, bytes_.size()));
  }

  const std::string& bytes_;
  const std::string& what_;
  PlyHeader header_;
  int line_number_ = 1;
  bool has_format_ = false;
};

/// The numbers of a body, one after the other.
class Body {
 public:
  Body(Format format, std::string_view bytes, const std::string& what)
      : format_(format), bytes_(bytes), words_(format == Format::text ? bytes : std::string_view()), what_(what) {}

  /// Throws Error if bytes are left: then the header claims too few numbers, or numbers of the wrong type.
  void finish() {
    if (format_ == Format::text && !words_.is_at_end())
      throw Error(what_ + ": has more numbers than its header claims; it is damaged");
    if (format_ != Format::text && at_ != bytes_.size())
      throw Error(formatted(
          "{}: its header claims {} bytes of numbers, but the file has {} after it; it is damaged: export it again",
          what_, at_, bytes_.size()));
  }

  double next(Number type) {
    if (format_ == Format::text) {
      const auto value = words_.number();
      if (!value) cut_off();
      return *value;
    }
    switch (type) {
      case Number::i8:
        return take<std::int8_t>();
      case Number::u8:
        return take<std::uint8_t>();
      case Number::i16:
        return take<std::int16_t>();
      case Number::u16:
        return take<std::uint16_t>();
      case Number::i32:
        return take<std::int32_t>();
      case Number::u32:
        return take<std::uint32_t>();
      case Number::f32:
        return take<float>();
      case Number::f64:
        break;
    }
    return take<double>();
  }

  /// Length of a list. Throws Error if the file cannot hold so many numbers.
  std::size_t length(const Property& list) {
    const double count = next(*list.count_type);
    if (!(count >= 0) || count != std::floor(count) || count > double(bytes_.size()) ||
        (format_ != Format::text && std::size_t(count) > (bytes_.size() - at_) / kBytes[int(list.type)]))
      cut_off();
    return std::size_t(count);
  }
  void skip(const Property& property) {
    for (std::size_t left = property.count_type ? length(property) : 1; left > 0; --left) next(property.type);
  }

 private:
  [[noreturn]] void cut_off() const {
    throw Error(what_ + ": has fewer numbers than its header claims; it is cut off or damaged");
  }
  template <class T>
  double take() {
    if (bytes_.size() - at_ < sizeof(T)) cut_off();
    char raw[sizeof(T)];
    std::memcpy(raw, bytes_.data() + at_, sizeof(T));
    if (format_ == Format::big) std::reverse(raw, raw + sizeof(T));
    T value;
    std::memcpy(&value, raw, sizeof(T));
    at_ += sizeof(T);
    return double(value);
  }
  Format format_;
  std::string_view bytes_;
  Words words_;
  const std::string& what_;
  std::size_t at_ = 0;
};

std::vector<std::uint32_t> read_vertices(const Element& element, Body& body, MeshBuilder& builder,
                                         const std::string& what) {
  std::vector<int> axis;  // for each property: 0 to 2 for x, y, z; -1: none
  int axes = 0;
  for (const Property& property : element.properties) {
    const bool is_axis = !property.count_type && (property.name == "x" || property.name == "y" || property.name == "z");
    axis.push_back(is_axis ? property.name[0] - 'x' : -1);
    axes += is_axis;
  }
  if (axes != 3) throw Error(what + ": its vertices have no x, y and z");
  std::vector<std::uint32_t> index;
  index.reserve(element.count);
  for (std::size_t i = 0; i < element.count; ++i) {
    Eigen::Vector3d point;
    for (std::size_t k = 0; k < axis.size(); ++k)
      if (axis[k] >= 0)
        point[axis[k]] = body.next(element.properties[k].type);
      else
        body.skip(element.properties[k]);
    index.push_back(builder.vertex(point));
  }
  return index;
}

void read_polygon(const Property& property, Body& body, MeshBuilder& builder, const std::vector<std::uint32_t>& index,
                  const std::string& what) {
  std::vector<std::uint32_t> polygon(body.length(property));
  for (std::uint32_t& vertex : polygon) {
    const double corner = body.next(property.type);
    if (!(corner >= 0) || corner >= double(index.size()) || corner != std::floor(corner)) {
      const std::string text = formatted("{:.10g}", corner);
      throw Error(formatted("{}: a face names vertex {}; there are {}", what, text, index.size()));
    }
    vertex = index[std::size_t(corner)];
  }
  add_polygon(polygon, builder, what);
}

void read_faces(const Element& element, Body& body, MeshBuilder& builder, const std::vector<std::uint32_t>& index,
                const std::string& what) {
  for (std::size_t i = 0; i < element.count; ++i)
    for (const Property& property : element.properties)
      if (property.count_type && (property.name == "vertex_indices" || property.name == "vertex_index"))
        read_polygon(property, body, builder, index, what);
      else
        body.skip(property);
}

}  // namespace

MarkedMesh read_ply(std::string bytes, const std::string& what) {
  if (begins_as_utf16(bytes) || bytes.starts_with("\xEF\xBB\xBF")) bytes = plain_text(std::move(bytes));
  const PlyHeader header = HeaderReader(bytes, what).read();
  Body body(header.format, std::string_view(bytes).substr(header.end), what);
  std::size_t faces = 0;
  for (const Element& element : header.elements)
    if (element.name == "face") faces = element.count;
  MeshBuilder builder(faces);
  std::vector<std::uint32_t> index;
  for (const Element& element : header.elements) {
    if (element.name == "vertex") {
      index = read_vertices(element, body, builder, what);
    } else if (element.name == "face") {
      read_faces(element, body, builder, index, what);
    } else if (element.name == "tristrips" && element.count > 0) {
      throw Error(what + ": has strips of triangles ('tristrips'), which are not read; save it with faces");
    } else {
      for (std::size_t i = 0; i < element.count; ++i)
        for (const Property& property : element.properties) body.skip(property);
    }
  }
  body.finish();
  return {std::move(builder.mesh), header.space};
}

}  // namespace marrow::files
