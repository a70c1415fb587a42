// SPDX-License-Identifier: Apache-2.0
#include "nrrd_axes.hpp"

#include <algorithm>

#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

/// The items of a field that has one for each axis: words, texts in quotation marks and vectors in parentheses.
std::vector<std::string> items_of(const std::string& text) {
  std::vector<std::string> items;
  for (std::size_t at = 0; (at = text.find_first_not_of(" \t", at)) != std::string::npos;) {
    const char closing = text[at] == '(' ? ')' : text[at] == '"' ? '"' : '\0';
    std::size_t end = closing ? text.find(closing, at + 1) : text.find_first_of(" \t", at);
    end = std::min(end == std::string::npos || !closing ? end : end + 1, text.size());
    items.push_back(text.substr(at, end - at));
    at = end;
  }
  return items;
}

/// Whether the header says that an axis is not one of space.
bool holds_values(const HeaderFields& fields, std::size_t axis, std::size_t axes) {
  const auto directions = items_of(in_small_letters(fields.text_or("space directions", "")));
  if (directions.size() == axes) return directions[axis] == "none";
  const auto kinds = items_of(in_small_letters(fields.text_or("kinds", "")));
  if (kinds.size() != axes) return false;
  const std::string& kind = kinds[axis];
  return kind != "domain" && kind != "space" && kind != "none" && kind != "???";
}

void remove_axis(HeaderFields& fields, std::size_t axis, std::size_t axes) {
  for (const char* key : {"sizes", "spacings", "thicknesses", "axis mins", "axis maxs", "space directions", "centers",
                          "kinds", "labels", "units"}) {
    std::vector<std::string> items = items_of(fields.text_or(key, ""));
    if (items.size() != axes) continue;  // the reader refuses it
    items.erase(items.begin() + std::ptrdiff_t(axis));
    std::string text;
    for (const std::string& item : items) text += (text.empty() ? "" : " ") + item;
    fields.replace(key, text);
  }
  fields.replace("dimension", formatted("{}", axes - 1));
}

}  // namespace

HeaderFields without_single_samples(HeaderFields fields) {
  std::size_t axes = items_of(fields.text_or("sizes", "")).size();
  if (fields.text_or("dimension", "") != formatted("{}", axes)) return fields;
  const auto remove_if = [&](std::size_t least, auto is_wanted) {
    for (std::size_t axis = axes; axis-- > 0 && axes > least;)
      if (items_of(fields.text("sizes"))[axis] == "1" && is_wanted(axis)) remove_axis(fields, axis, axes--);
  };
  remove_if(1, [&](std::size_t axis) { return holds_values(fields, axis, axes); });
  remove_if(3, [&](std::size_t axis) { return axis >= 3 && !fields.has("space directions"); });
  return fields;
}

std::optional<std::size_t> axis_of_layers(const HeaderFields& fields) {
  constexpr std::size_t kAxes = 4;
  if (fields.text_or("dimension", "") != "4" || items_of(fields.text_or("sizes", "")).size() != kAxes) return {};
  for (std::size_t axis = 0; axis < kAxes; ++axis)
    if (holds_values(fields, axis, kAxes)) return axis;
  return {};
}

HeaderFields without_axis(HeaderFields fields, std::size_t axis) {
  remove_axis(fields, axis, items_of(fields.text_or("sizes", "")).size());
  return fields;
}

}  // namespace marrow::files
