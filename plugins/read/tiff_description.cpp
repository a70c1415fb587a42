// SPDX-License-Identifier: Apache-2.0
#include "tiff_description.hpp"

#include <cstdlib>

#include "header_lines.hpp"

namespace marrow::read {
namespace {

constexpr const char* kShape = "\"shape\": [";

/// The whole number behind `name`, or 1.
long number_behind(const std::string& text, const std::string& name) {
  const std::size_t found = text.find(name);
  return found == std::string::npos ? 1 : std::atol(text.c_str() + found + name.size());
}

std::string of_imagej(const std::string& text) {
  for (const char* name : {"channels", "frames"})
    if (const long count = number_behind("\n" + text, std::string("\n") + name + "="); count > 1)
      return "an ImageJ stack of " + std::to_string(count) + " " + name;
  return {};
}

std::string of_ome(const std::string& text) {
  for (const auto& [attribute, name] : {std::pair{" SizeC=\"", "channels"}, std::pair{" SizeT=\"", "times"}})
    if (const long count = number_behind(text, attribute); count > 1)
      return "an OME stack of " + std::to_string(count) + " " + name;
  return {};
}

std::string of_tifffile(const std::string& text) {
  const std::size_t begin = text.find('[', text.find(kShape)), end = text.find(']', begin);
  if (end == std::string::npos) return {};
  const std::string shape = text.substr(begin, end - begin + 1);
  int dimensions = 0;
  for (const char* at = shape.c_str() + 1; *at;) {
    char* stop = nullptr;
    if (const long length = std::strtol(at, &stop, 10); length > 1) ++dimensions;
    at = stop == at ? at + 1 : stop;
  }
  if (dimensions > 3) return "an array of " + std::to_string(dimensions) + " dimensions, " + shown(shape);
  const std::size_t key = text.find("\"axes\": \"");
  const std::string axes = key == std::string::npos ? "" : text.substr(key + 9, text.find('"', key + 9) - (key + 9));
  if (dimensions == 3 && axes.size() == 3 && (axes[0] == 'T' || axes[0] == 'C'))
    return std::string("a stack of ") + (axes[0] == 'T' ? "times" : "channels");
  return {};
}

}  // namespace

TiffDescription read_tiff_description(const std::string& text) {
  TiffDescription description;
  if (text.starts_with("ImageJ=")) description.other_pages = of_imagej(text);
  if (text.find("<OME") != std::string::npos) description.other_pages = of_ome(text);
  if (text.starts_with("{") && text.find(kShape) != std::string::npos) {
    description.other_pages = of_tifffile(text);
    description.is_truncated = text.find("\"truncated\": true") != std::string::npos;
  }
  return description;
}

}  // namespace marrow::read
