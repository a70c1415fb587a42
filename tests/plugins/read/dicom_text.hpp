// SPDX-License-Identifier: Apache-2.0
#pragma once
// X-ray files as a C-arm writes them, built element by element, so that each element may be missing or wrong.
#include <bit>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace marrow::test {

/// Elements of explicit little endian DICOM by tag. A value's kind stands before it: "DS:1000".
using Elements = std::map<std::uint32_t, std::string>;

inline std::string little(std::uint64_t value, int width) {
  std::string bytes;
  for (int i = 0; i < width; ++i) bytes += char(value >> (8 * i));
  return bytes;
}

inline std::string dicom_element(std::uint32_t tag, const std::string& kind, std::string value) {
  if (value.size() % 2) value += kind == "UI" ? '\0' : ' ';
  const bool is_long = kind == "OW" || kind == "OB" || kind == "SQ" || kind == "UN";
  return little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + kind +
         (is_long ? little(0, 2) + little(std::uint32_t(value.size()), 4) : little(std::uint32_t(value.size()), 2)) +
         value;
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
    const std::string one = dicom_elements({{tag, text}}), kind = text.substr(0, 2);
    const std::string value = one.substr(kind == "OW" || kind == "OB" || kind == "SQ" || kind == "UN" ? 12 : 8);
    bytes += little(tag >> 16, 2) + little(tag & 0xFFFF, 2) + little(std::uint32_t(value.size()), 4) + value;
  }
  return bytes;
}

/// A sequence, as the value of an element: "SQ:" before it. Each item is what dicom_elements() or implicit_elements()
/// gave.
inline std::string dicom_items(const std::vector<std::string>& items) {
  std::string bytes = "SQ:";
  for (const std::string& item : items) bytes += little(0xE000FFFEu, 4) + little(std::uint32_t(item.size()), 4) + item;
  return bytes;
}

/// A sequence of one item, as the value of an element: "SQ:" before it.
inline std::string dicom_item(const Elements& elements) {
  const std::string content = dicom_elements(elements);
  return "SQ:" + little(0xE000FFFEu, 4) + little(std::uint32_t(content.size()), 4) + content;
}

/// `media_class`: MediaStorageSOPClassUID; empty for none.
inline std::string dicom_start(const std::string& transfer_syntax, const std::string& media_class = "") {
  const std::string meta = dicom_element(0x00020001, "OB", std::string("\0\1", 2)) +
                           (media_class.empty() ? "" : dicom_element(0x00020002, "UI", media_class)) +
                           dicom_element(0x00020010, "UI", transfer_syntax);
  return std::string(128, '\0') + "DICM" + dicom_element(0x00020000, "UL", little(std::uint32_t(meta.size()), 4)) +
         meta;
}

inline std::string dicom_file(const Elements& elements) {
  return dicom_start("1.2.840.10008.1.2.1") + dicom_elements(elements);
}
inline std::string implicit_file(const Elements& elements) {
  return dicom_start("1.2.840.10008.1.2") + implicit_elements(elements);
}

/// A frontal fluoroscopy: 6 columns, 4 rows, grey values 100 v + u.
inline Elements fluoroscopy() {
  std::string pixels;
  for (int v = 0; v < 4; ++v)
    for (int u = 0; u < 6; ++u) pixels += little(std::uint32_t(100 * v + u), 2);
  return {{0x00080016, "UI:1.2.840.10008.5.1.4.1.1.12.1"},
          {0x00080060, "CS:XA"},
          {0x00181110, "DS:1000"},
          {0x00181111, "DS:600"},
          {0x00181164, "DS:0.4\\0.3"},
          {0x00181500, "CS:STATIC"},
          {0x00181510, "DS:0"},
          {0x00181511, "DS:0"},
          {0x00185100, "CS:HFS"},
          {0x00200020, "CS:R\\F"},
          {0x00280002, "US:1"},
          {0x00280004, "CS:MONOCHROME2"},
          {0x00280010, "US:4"},
          {0x00280011, "US:6"},
          {0x00280100, "US:16"},
          {0x00280101, "US:16"},
          {0x00280102, "US:15"},
          {0x00280103, "US:0"},
          {0x7FE00010, "OW:" + pixels}};
}

/// A CT slice of 4 x 3 pixels that hold 0 to 11.
inline Elements ct_slice(int z) {
  std::string pixels;
  for (int i = 0; i < 12; ++i) pixels += little(std::uint32_t(i), 2);
  return {{0x00080060, "CS:CT"},
          {0x0020000E, "UI:1.2.9"},
          {0x00200032, "DS:0\\0\\" + std::to_string(z)},
          {0x00200037, "DS:1\\0\\0\\0\\1\\0"},
          {0x00280002, "US:1"},
          {0x00280004, "CS:MONOCHROME2"},
          {0x00280010, "US:3"},
          {0x00280011, "US:4"},
          {0x00280030, "DS:1\\1"},
          {0x00280100, "US:16"},
          {0x00280101, "US:16"},
          {0x00280102, "US:15"},
          {0x00280103, "US:0"},
          {0x00281052, "DS:-1024"},
          {0x00281053, "DS:1"},
          {0x7FE00010, "OW:" + pixels}};
}

}  // namespace marrow::test
