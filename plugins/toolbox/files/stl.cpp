// SPDX-License-Identifier: Apache-2.0
// STL as binary and as text. Its 80 bytes of header, or the names of its solids, may hold a mark of the coordinates.
#include <cstring>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/plain_text.hpp"
#include "mesh_parts.hpp"

namespace marrow::files {
namespace {

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
