// SPDX-License-Identifier: Apache-2.0
// From the stored numbers of a DICOM file to its values.
#include <algorithm>
#include <cmath>
#include <cstring>

#include "dicom_pixels.hpp"
#include "header_lines.hpp"
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

constexpr DicomTag kTable{0x0028, 0x3000, "ModalityLUTSequence"};
constexpr DicomTag kIntensityTables{0x0028, 0x9422, "PixelIntensityRelationshipLUTSequence"};
constexpr DicomTag kTableFunction{0x0028, 0x9474, "LUTFunction"};
constexpr DicomTag kLayout{0x0028, 0x3002, "LUTDescriptor"};
constexpr DicomTag kTableType{0x0028, 0x3004, "ModalityLUTType"};
constexpr DicomTag kEntries{0x0028, 0x3006, "LUTData"};

[[noreturn]] void damaged_table(const DicomHeader& header, const std::string& fault) {
  throw Error(header.path().string() + ": is damaged: in the table for its values (" +
              (header.has(kTable) ? kTable : kIntensityTables).text() + ") " + fault + "; copy or export it again");
}

/// The item with the table for values: that of all images, or, where values are logarithms, the one of an enhanced XA
/// that makes them linear (PS3.3 C.7.6.16.2.13). nullptr if there is none.
const DicomElements* item_of_table(const DicomFile& file, const DicomHeader& header) {
  if (const auto* items = header.items(kTable)) {
    if (items->size() != 1) damaged_table(header, formatted("{} items stand where one should", items->size()));
    return &items->front();
  }
  const auto* items = header.text(kIntensity).value_or("") == "LOG" ? header.items(kIntensityTables) : nullptr;
  const DicomElements* found = nullptr;
  for (std::size_t i = 0; items && i < items->size(); ++i) {
    const DicomElement* function = find_element(header.path(), (*items)[i], kTableFunction.code());
    if (!function || function->value.bytes > 64 || without_padding(file.text(function->value)) != "TO_LINEAR") continue;
    if (found) damaged_table(header, "TO_LINEAR stands twice (" + kTableFunction.text() + ")");
    found = &(*items)[i];
  }
  return found;
}

double value_of(const DicomPixels& pixels, double stored) {
  return pixels.table ? pixels.table->value_of(stored) : pixels.slope * stored + pixels.intercept;
}

template <class T>
void scale(const DicomPixels& pixels, const std::vector<std::byte>& bytes, float* values) {
  const double slope = pixels.slope, intercept = pixels.intercept;
  for (std::size_t i = 0; i < bytes.size() / sizeof(T); ++i) {
    T value;
    std::memcpy(&value, bytes.data() + i * sizeof(T), sizeof(T));
    values[i] = float(pixels.table ? pixels.table->value_of(double(value)) : slope * double(value) + intercept);
  }
}

}  // namespace

double DicomTable::value_of(double stored) const {
  return entries[std::size_t(std::clamp(stored - first, 0.0, double(entries.size() - 1)))];
}

std::optional<DicomTable> read_dicom_table(const DicomFile& file, const DicomHeader& header) {
  const DicomElements* const item = item_of_table(file, header);
  if (!item) return std::nullopt;
  const auto bytes = [&](const DicomTag& tag, std::uint64_t most) {
    const DicomElement* element = find_element(header.path(), *item, tag.code());
    if (!element || element->value.bytes == 0) damaged_table(header, tag.text() + " is missing");
    if (element->value.bytes > most)
      damaged_table(header, formatted("{} has {} bytes", tag.text(), element->value.bytes));
    return std::pair(file.text(element->value), element);
  };
  const auto [layout, given] = bytes(kLayout, 6);
  if (layout.size() != 6) damaged_table(header, kLayout.text() + " has not 3 numbers");
  const auto word = [&](const std::string& text, std::size_t at) {
    return std::uint16_t(number_in_bytes(std::string_view(text).substr(at, 2), given->big_endian));
  };
  const std::string_view kind(given->kind.data(), given->kind.size());
  const bool is_signed = kind == "SS" || (kind != "US" && header.number(kPixelRepresentation).value_or(0) == 1);
  const std::size_t count = word(layout, 0) == 0 ? 65536 : word(layout, 0);
  DicomTable table;
  table.first = is_signed ? double(std::int16_t(word(layout, 2))) : double(word(layout, 2));
  table.bits = word(layout, 4);
  if (table.bits < 8 || table.bits > 16) damaged_table(header, formatted("entries have {} bits", table.bits));
  const std::string entries = bytes(kEntries, 2 * 65536).first;
  const bool are_bytes = table.bits == 8 && entries.size() == count + count % 2;
  if (!are_bytes && entries.size() != 2 * count)
    damaged_table(header, formatted("{} entries are told, but there are {} bytes of them", count, entries.size()));
  for (std::size_t i = 0; i < count; ++i)
    table.entries.push_back(are_bytes ? std::uint8_t(entries[i]) : word(entries, 2 * i));
  if (*std::max_element(table.entries.begin(), table.entries.end()) >> table.bits != 0)
    damaged_table(header, formatted("an entry has more than {} bits", table.bits));
  const DicomElement* type = find_element(header.path(), *item, kTableType.code());
  if (type && type->value.bytes <= 64) table.type = without_padding(file.text(type->value));
  return table;
}

void make_padding_air(const DicomPixels& pixels, float* values, std::size_t count) {
  constexpr float kAir_hu = -1000;
  if (!pixels.padding) return;
  const auto scaled = [&](double stored) { return float(value_of(pixels, stored)); };
  const auto [lowest, highest] = std::minmax({scaled((*pixels.padding)[0]), scaled((*pixels.padding)[1])});
  for (std::size_t i = 0; i < count; ++i)
    if (values[i] >= lowest && values[i] <= highest) values[i] = std::min(values[i], kAir_hu);
}

double sum_of_limits(const DicomPixels& pixels) {
  if (pixels.table) return std::ldexp(1, pixels.table->bits) - 1;
  const double sum = pixels.is_signed ? -1 : std::ldexp(1, pixels.bits_stored) - 1;  // signed: -2048 to 2047
  return pixels.slope * sum + 2 * pixels.intercept;
}

void scaled_values(const DicomPixels& pixels, const Samples& samples, float* values) {
  using Type = Samples::Type;
  switch (samples.type) {
    case Type::u8:
      return scale<std::uint8_t>(pixels, samples.bytes, values);
    case Type::i8:
      return scale<std::int8_t>(pixels, samples.bytes, values);
    case Type::u16:
      return scale<std::uint16_t>(pixels, samples.bytes, values);
    case Type::i16:
      return scale<std::int16_t>(pixels, samples.bytes, values);
    case Type::u32:
      return scale<std::uint32_t>(pixels, samples.bytes, values);
    default:
      return scale<std::int32_t>(pixels, samples.bytes, values);
  }
}

}  // namespace marrow::files
