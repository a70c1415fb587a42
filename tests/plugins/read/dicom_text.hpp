// SPDX-License-Identifier: Apache-2.0
#pragma once
// X-ray files as a C-arm writes them, built element by element, so that each element may be missing or wrong.
#include <bit>
#include <cstdint>
#include <map>
#include <sstream>
#include <vector>

#include "tests/plugins/read/files.hpp"

namespace marrow::test {

/// Elements of explicit little endian DICOM by tag. A value's kind stands before it: "DS:1000".
using Elements = std::map<std::uint32_t, std::string>;

/// From a text of tags and values, with blanks between them.
inline Elements elements_of(const std::string& text) {
  Elements elements;
  std::istringstream words(text);
  for (std::string tag, value; words >> tag >> value;) elements[std::uint32_t(std::stoul(tag, nullptr, 16))] = value;
  return elements;
}

/// The elements with others added, or in the place of those of the same tag.
inline Elements but(Elements elements, const Elements& by) {
  for (const auto& [tag, value] : by) elements[tag] = value;
  return elements;
}
inline Elements without(Elements elements, const std::vector<std::uint32_t>& tags) {
  for (const std::uint32_t tag : tags) elements.erase(tag);
  return elements;
}

inline bool has_long_length(const std::string& kind) {
  return kind == "OW" || kind == "OB" || kind == "SQ" || kind == "UN";
}

inline std::string tag_bytes(std::uint32_t tag) { return little(tag >> 16, 2) + little(tag & 0xFFFF, 2); }

inline std::string dicom_element(std::uint32_t tag, const std::string& kind, std::string value) {
  if (value.size() % 2) value += kind == "UI" ? '\0' : ' ';
  return tag_bytes(tag) + kind +
         (has_long_length(kind) ? little(0, 2) + little(value.size(), 4) : little(value.size(), 2)) + value;
}

inline std::string dicom_elements(const Elements& elements) {
  std::string bytes;
  for (const auto& [tag, text] : elements) {
    const std::string kind = text.substr(0, 2), value = text.substr(3);
    bytes += dicom_element(tag, kind,
                           kind == "US" || kind == "SS" ? little(std::uint32_t(std::stoi(value)), 2)
                           : kind == "FL"               ? little(std::bit_cast<std::uint32_t>(std::stof(value)), 4)
                                                        : value);
  }
  return bytes;
}

/// The same in implicit little endian, where no kind is written.
inline std::string implicit_elements(const Elements& elements) {
  std::string bytes;
  for (const auto& [tag, text] : elements) {
    const std::string value = dicom_elements({{tag, text}}).substr(has_long_length(text.substr(0, 2)) ? 12 : 8);
    bytes += tag_bytes(tag) + little(value.size(), 4) + value;
  }
  return bytes;
}

inline std::string dicom_item_bytes(std::uint32_t tag, const std::string& content) {
  return tag_bytes(tag) + little(content.size(), 4) + content;
}

/// A sequence, as the value of an element: "SQ:" before it. Each item is what dicom_elements() or implicit_elements()
/// gave.
inline std::string dicom_items(const std::vector<std::string>& items) {
  std::string bytes = "SQ:";
  for (const std::string& item : items) bytes += dicom_item_bytes(0xFFFEE000, item);
  return bytes;
}
inline std::string dicom_item(const Elements& elements) { return dicom_items({dicom_elements(elements)}); }

/// An element of undefined length: fragments after an empty table of offsets, as of compressed pixels.
inline std::string dicom_fragments(std::uint32_t tag, const std::vector<std::string>& parts) {
  std::string bytes = tag_bytes(tag) + "OB" + little(0, 2) + little(0xFFFFFFFF, 4) + dicom_item_bytes(0xFFFEE000, "");
  for (const std::string& part : parts) bytes += dicom_item_bytes(0xFFFEE000, part);
  return bytes + dicom_item_bytes(0xFFFEE0DD, "");
}

/// `media_class`: MediaStorageSOPClassUID; empty for none.
inline std::string dicom_start(const std::string& transfer_syntax, const std::string& media_class = "") {
  const std::string meta = dicom_element(0x00020001, "OB", std::string("\0\1", 2)) +
                           (media_class.empty() ? "" : dicom_element(0x00020002, "UI", media_class)) +
                           dicom_element(0x00020010, "UI", transfer_syntax);
  return std::string(128, '\0') + "DICM" + dicom_element(0x00020000, "UL", little(meta.size(), 4)) + meta;
}

inline std::string dicom_file(const Elements& elements) {
  return dicom_start("1.2.840.10008.1.2.1") + dicom_elements(elements);
}
inline std::string implicit_file(const Elements& elements) {
  return dicom_start("1.2.840.10008.1.2") + implicit_elements(elements);
}

/// A frontal fluoroscopy: 6 columns, 4 rows, grey values 100 v + u.
inline Elements fluoroscopy() {
  Elements elements = elements_of(
      "00080016 UI:1.2.840.10008.5.1.4.1.1.12.1 00080060 CS:XA 00181110 DS:1000 00181111 DS:600 00181164 DS:0.4\\0.3 "
      "00181500 CS:STATIC 00181510 DS:0 00181511 DS:0 00185100 CS:HFS 00200020 CS:R\\F 00280002 US:1 "
      "00280004 CS:MONOCHROME2 00280010 US:4 00280011 US:6 00280100 US:16 00280101 US:16 00280102 US:15 00280103 US:0 "
      "7FE00010 OW:");
  for (int v = 0; v < 4; ++v)
    for (int u = 0; u < 6; ++u) elements[0x7FE00010] += little(std::uint32_t(100 * v + u), 2);
  return elements;
}

/// A CT slice of 4 x 3 pixels that hold 0 to 11.
inline Elements ct_slice(int z) {
  Elements elements = elements_of(
      "00080060 CS:CT 0020000E UI:1.2.9 00200037 DS:1\\0\\0\\0\\1\\0 00280002 US:1 00280004 CS:MONOCHROME2 00280010 "
      "US:3 "
      "00280011 US:4 00280030 DS:1\\1 00280100 US:16 00280101 US:16 00280102 US:15 00280103 US:0 00281052 DS:-1024 "
      "00281053 DS:1 7FE00010 OW:");
  elements[0x00200032] = "DS:0\\0\\" + std::to_string(z);
  for (int i = 0; i < 12; ++i) elements[0x7FE00010] += little(std::uint32_t(i), 2);
  return elements;
}

}  // namespace marrow::test
