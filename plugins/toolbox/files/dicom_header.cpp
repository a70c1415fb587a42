// SPDX-License-Identifier: Apache-2.0
#include "dicom_header.hpp"

#include <bit>
#include <cmath>

#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

constexpr std::uint64_t kLongestText = 65536;  // enough for the angles of some thousand frames

/// Most files say how a number is written. Some write it in another way than the standard, so the file decides.
DicomTag::Kind kind_of(const DicomElement& element, const DicomTag& tag) {
  const std::string_view kind(element.kind.data(), element.kind.size());
  if (kind == "FL") return DicomTag::Kind::fl;
  if (kind == "FD") return DicomTag::Kind::fd;
  if (kind == "DS" || kind == "IS") return DicomTag::Kind::text;
  return tag.kind;
}

/// Numbers separated by backslashes. std::nullopt if the text holds anything else.
std::optional<std::vector<double>> numbers_in_text(const std::string& value) {
  std::vector<double> numbers;
  const char *at = value.data(), *end = at + value.size();
  while (true) {
    while (at != end && (*at == ' ' || *at == '+')) ++at;
    double number = 0;
    const auto [stop, failure] = std::from_chars(at, end, number);
    if (failure != std::errc() || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
    at = stop;
    while (at != end && *at == ' ') ++at;
    if (at == end) return numbers;
    if (*at++ != '\\') return std::nullopt;
  }
}

std::optional<std::vector<double>> binary_numbers(const std::string& bytes, DicomTag::Kind kind, bool big_endian) {
  using Kind = DicomTag::Kind;
  const std::size_t width = kind == Kind::fd ? 8 : kind == Kind::fl ? 4 : 2;
  if (bytes.empty() || bytes.size() % width != 0) return std::nullopt;
  std::vector<double> numbers;
  for (std::size_t at = 0; at < bytes.size(); at += width) {
    const std::uint64_t value = number_in_bytes(std::string_view(bytes).substr(at, width), big_endian);
    const double number = kind == Kind::fd   ? std::bit_cast<double>(value)
                          : kind == Kind::fl ? double(std::bit_cast<float>(std::uint32_t(value)))
                          : kind == Kind::ss ? double(std::int16_t(value))
                                             : double(value);
    if (!std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers;
}

bool is_there(const DicomElement* element) { return element && (element->value.bytes > 0 || !element->items.empty()); }

/// The direction in patient coordinates for letters such as "L" or "LA". Each letter has half the weight of the one
/// before.
std::optional<Eigen::Vector3d> direction_of(const std::string& letters) {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  double weight = 1;
  for (const char letter : letters) {
    const std::string known = "LRPAHF";
    const std::size_t at = known.find(letter);
    if (at == std::string::npos) return std::nullopt;
    direction[Eigen::Index(at / 2)] += at % 2 == 0 ? weight : -weight;
    weight *= 0.5;
  }
  if (direction.isZero()) return std::nullopt;
  return direction.normalized();
}

}  // namespace

std::string without_padding(std::string value) {
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!value.empty() && is_padding(value.back())) value.pop_back();
  value.erase(0, std::min(value.find_first_not_of(std::string(" \0", 2)), value.size()));
  return value;
}

std::string DicomTag::text() const { return formatted("{} ({:04x},{:04x})", name, group, element); }

/// Looks for the element in a functional group, then in the sequences inside it.
const DicomElement* DicomHeader::find_inside(const DicomElements& elements, std::uint32_t tag) const {
  if (const auto* element = find_element(path(), elements, tag); is_there(element)) return element;
  for (const DicomElement& element : elements) {
    if (!is_group_of_values(element.tag)) continue;
    for (const DicomElements& item : element.items)
      if (const auto* found = find_inside(item, tag)) return found;
  }
  return nullptr;
}

/// Looks in the frame's own functional group, then in the shared one, then in the data set itself.
const DicomElement* DicomHeader::find(const DicomTag& tag) const {
  for (const std::uint32_t groups : {kFrameGroups, kSharedGroups}) {
    const auto* sequence = find_element(path(), file_.elements(), groups);
    const std::size_t item = groups == kFrameGroups ? std::size_t(frame_ - 1) : 0;
    if (!sequence || item >= sequence->items.size()) continue;
    if (const auto* element = find_inside(sequence->items[item], tag.code())) return element;
  }
  const auto* element = find_element(path(), file_.elements(), tag.code());
  return is_there(element) ? element : nullptr;
}

std::string DicomHeader::bytes_of(const DicomElement& element, const DicomTag& tag) const {
  if (element.value.bytes > kLongestText)
    throw Error(formatted("{}: {} has {} bytes; at most {} are read", path().string(), tag.text(), element.value.bytes,
                          kLongestText));
  return file_.text(element.value);
}

std::optional<std::string> DicomHeader::text(const DicomTag& tag) const {
  const DicomElement* element = find(tag);
  if (!element || element->value.bytes == 0) return std::nullopt;
  const std::string value = without_padding(bytes_of(*element, tag));
  if (value.empty()) return std::nullopt;
  return value;
}

std::optional<std::vector<double>> DicomHeader::numbers(const DicomTag& tag, std::size_t count) const {
  const DicomElement* element = find(tag);
  if (!element || element->value.bytes == 0) return std::nullopt;
  const DicomTag::Kind kind = kind_of(*element, tag);
  const std::string bytes = bytes_of(*element, tag), value = kind == DicomTag::Kind::text ? without_padding(bytes) : "";
  if (kind == DicomTag::Kind::text && value.empty()) return std::nullopt;
  auto numbers =
      kind == DicomTag::Kind::text ? numbers_in_text(value) : binary_numbers(bytes, kind, element->big_endian);
  if (!numbers || (count > 0 && numbers->size() != count)) {
    const std::string expected = count == 0 ? "numbers" : counted(count, "number");
    throw Error(path().string() + ": " + tag.text() + ": expected " + expected + ", got " +
                (kind == DicomTag::Kind::text
                     ? "'" + shown(value) + "'"
                     : formatted("{} bytes of such numbers or a value that is none", bytes.size())) +
                "; its header is wrong: export it again");
  }
  return numbers;
}

std::optional<double> DicomHeader::number(const DicomTag& tag) const {
  const auto values = numbers(tag, 1);
  if (!values) return std::nullopt;
  return (*values)[0];
}

std::optional<PatientOrientation> patient_orientation(const DicomHeader& header) {
  const auto text = header.text(kPatientOrientation);
  if (!text) return std::nullopt;
  const std::size_t between = text->find('\\');
  if (between == std::string::npos) return std::nullopt;
  const auto right = direction_of(text->substr(0, between)), down = direction_of(text->substr(between + 1));
  if (!right || !down) return std::nullopt;
  return PatientOrientation{*text, *right, *down};
}

}  // namespace marrow::files
