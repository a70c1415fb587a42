// SPDX-License-Identifier: Apache-2.0
#include "dicom_header.hpp"

#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmStringFilter.h>

#include <charconv>
#include <cmath>

#include "marrow/domain/error.hpp"
#include "samples.hpp"

namespace marrow::read {
namespace {

const gdcm::Tag kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230);

/// The element among those of a data set or, where `deep`, of the sequences in it, the outermost first.
const gdcm::DataElement* find_element(const gdcm::DataSet& set, const gdcm::Tag& tag, bool deep) {
  if (const gdcm::DataElement& element = set.GetDataElement(tag); set.FindDataElement(tag) && !element.IsEmpty()) return &element;
  if (!deep) return nullptr;
  for (const gdcm::DataElement& element : set.GetDES()) {
    const auto sequence = element.GetValueAsSQ();
    if (!sequence) continue;
    for (gdcm::SequenceOfItems::SizeType i = 1; i <= sequence->GetNumberOfItems(); ++i)
      if (const auto* found = find_element(sequence->GetItem(i).GetNestedDataSet(), tag, true)) return found;
  }
  return nullptr;
}

}  // namespace

std::string DicomTag::text() const {
  char numbers[16];
  std::snprintf(numbers, sizeof numbers, " (%04x,%04x)", group, element);
  return name + std::string(numbers);
}

struct DicomHeader::File {
  gdcm::Reader reader;
  int frame = 1;

  /// The text of an element, found in the data set itself, then in the frame's own functional group, then in the shared one.
  std::string text(const gdcm::Tag& tag) const {
    const gdcm::DataSet& set = reader.GetFile().GetDataSet();
    if (const auto* element = find_element(set, tag, false)) return text_of(*element);
    for (const gdcm::Tag& groups : {kFrameGroups, kSharedGroups}) {
      if (!set.FindDataElement(groups)) continue;
      const auto sequence = set.GetDataElement(groups).GetValueAsSQ();
      const gdcm::SequenceOfItems::SizeType item = groups == kFrameGroups ? gdcm::SequenceOfItems::SizeType(frame) : 1;
      if (!sequence || item > sequence->GetNumberOfItems()) continue;
      if (const auto* element = find_element(sequence->GetItem(item).GetNestedDataSet(), tag, true)) return text_of(*element);
    }
    return "";
  }
  std::string text_of(const gdcm::DataElement& element) const {
    gdcm::StringFilter filter;
    filter.SetFile(reader.GetFile());
    return filter.ToStringPair(element).second;
  }
};

DicomHeader::DicomHeader(const std::filesystem::path& path, int frame) : path_(path), file_(std::make_unique<File>()) {
  check_file(path);
  check_dicom_file(path);
  file_->frame = frame;
  file_->reader.SetFileName(path.c_str());
  if (!file_->reader.ReadUpToTag(gdcm::Tag(0x7fe0, 0x0010)))
    throw Error(path.string() + ": cannot be read as DICOM, it may be cut off or damaged; copy or export it again");
}

DicomHeader::~DicomHeader() = default;

std::optional<std::string> DicomHeader::text(const DicomTag& tag) const {
  std::string value = file_->text(gdcm::Tag(tag.group, tag.element));
  const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
  while (!value.empty() && is_padding(value.back())) value.pop_back();
  while (!value.empty() && is_padding(value.front())) value.erase(0, 1);
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
    throw Error(path_.string() + ": " + tag.text() + ": expected " + std::to_string(count) +
                (count == 1 ? " number" : " numbers") + ", got '" + value->substr(0, 60) + "'");
  return numbers;
}

std::optional<double> DicomHeader::number(const DicomTag& tag) const {
  const auto values = numbers(tag, 1);
  if (!values) return std::nullopt;
  return (*values)[0];
}

}  // namespace marrow::read
