// SPDX-License-Identifier: Apache-2.0
#include "dicom_header.hpp"

#include <charconv>
#include <cmath>

#include "header_lines.hpp"
#include "marrow/domain/error.hpp"

namespace marrow::read {
namespace {

constexpr std::uint64_t kLongestText = 4096;

}  // namespace

std::string DicomTag::text() const {
  char numbers[16];
  std::snprintf(numbers, sizeof numbers, " (%04x,%04x)", group, element);
  return name + std::string(numbers);
}

/// The element among those of a functional group, or of the sequences in it, the outermost first.
const DicomElement* DicomHeader::find_inside(const DicomElements& elements, std::uint32_t tag) const {
  if (const auto* element = find_element(path(), elements, tag); element && element->value.bytes > 0) return element;
  for (const DicomElement& element : elements) {
    if (!is_group_of_values(element.tag)) continue;
    for (const DicomElements& item : element.items)
      if (const auto* found = find_inside(item, tag)) return found;
  }
  return nullptr;
}

/// In the frame's own functional group, then in the shared one, then in the data set itself.
const DicomElement* DicomHeader::find(const DicomTag& tag) const {
  for (const std::uint32_t groups : {kFrameGroups, kSharedGroups}) {
    const auto* sequence = find_element(path(), file_.elements(), groups);
    const std::size_t item = groups == kFrameGroups ? std::size_t(frame_ - 1) : 0;
    if (!sequence || item >= sequence->items.size()) continue;
    if (const auto* element = find_inside(sequence->items[item], tag.code())) return element;
  }
  const auto* element = find_element(path(), file_.elements(), tag.code());
  if (element && (element->value.bytes > 0 || !element->items.empty())) return element;
  return nullptr;
}

std::optional<std::string> DicomHeader::text(const DicomTag& tag) const {
  const DicomElement* element = find(tag);
  if (!element || element->value.bytes == 0) return std::nullopt;
  if (element->value.bytes > kLongestText)
    throw Error(path().string() + ": " + tag.text() + " has " + std::to_string(element->value.bytes) +
                " bytes; it is damaged");
  std::string value = file_.file().text(element->value.begin, std::size_t(element->value.bytes));
  if (tag.kind != DicomTag::Kind::text) {
    if (value.size() != 2)
      throw Error(path().string() + ": " + tag.text() + " has " + std::to_string(value.size()) +
                  " bytes; expected 2: it is damaged");
    const int low = std::uint8_t(value[element->big_endian ? 1 : 0]),
              high = std::uint8_t(value[element->big_endian ? 0 : 1]);
    const int number = high << 8 | low;
    return std::to_string(tag.kind == DicomTag::Kind::ss && number > 0x7FFF ? number - 0x10000 : number);
  }
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!value.empty() && is_padding(value.back())) value.pop_back();
  value.erase(0, std::min(value.find_first_not_of(std::string(" \0", 2)), value.size()));
  if (value.empty()) return std::nullopt;
  return value;
}

std::optional<std::vector<double>> DicomHeader::numbers(const DicomTag& tag, std::size_t count) const {
  const auto value = text(tag);
  if (!value) return std::nullopt;
  std::vector<double> numbers;
  const char *at = value->data(), *end = at + value->size();
  bool good = true;
  while (good) {
    while (at != end && (*at == ' ' || *at == '+')) ++at;
    double number = 0;
    const auto [stop, failure] = std::from_chars(at, end, number);
    good = failure == std::errc() && std::isfinite(number);
    if (good) numbers.push_back(number);
    at = stop;
    while (at != end && *at == ' ') ++at;
    if (at == end || *at != '\\') break;
    ++at;
  }
  if (!good || at != end || numbers.size() != count)
    throw Error(path().string() + ": " + tag.text() + ": expected " + std::to_string(count) +
                (count == 1 ? " number" : " numbers") + ", got '" + shown(*value) + "'");
  return numbers;
}

std::optional<double> DicomHeader::number(const DicomTag& tag) const {
  const auto values = numbers(tag, 1);
  if (!values) return std::nullopt;
  return (*values)[0];
}

}  // namespace marrow::read
