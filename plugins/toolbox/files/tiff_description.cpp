// SPDX-License-Identifier: Apache-2.0
#include "tiff_description.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>

#include "header_lines.hpp"
#include "marrow/base/number_text.hpp"

namespace marrow::files {
namespace {

constexpr const char* kShape = "\"shape\": [";

/// The whole number after `name`, or 1.
long number_behind(const std::string& text, const std::string& name) {
  const std::size_t found = text.find(name);
  return found == std::string::npos ? 1 : std::atol(text.c_str() + found + name.size());
}

/// The text of ImageJ's line "name=text". std::nullopt if there is no such line.
std::optional<std::string> line_behind(const std::string& text, const std::string& name) {
  const std::size_t found = ("\n" + text).find("\n" + name + "=");
  if (found == std::string::npos) return std::nullopt;
  const std::size_t begin = found + name.size() + 1;
  return trimmed(text.substr(begin, text.find_first_of("\r\n", begin) - begin));
}

/// ImageJ stores signed values, such as those of a CT, as unsigned numbers with a calibration: value = c0 + c1 *
/// number.
void read_calibration(const std::string& text, TiffDescription& description) {
  const auto function = line_behind(text, "cf"), c0 = line_behind(text, "c0"), c1 = line_behind(text, "c1");
  if (!function && !c0 && !c1) return;
  if (function != "0") {
    description.calibration = "its values are calibrated by ImageJ's function " + shown(function.value_or("(none)")) +
                              "; that of a straight line (cf=0) is read";
    return;
  }
  const auto intercept = number_of(c0.value_or("")), slope = number_of(c1.value_or(""));
  if (!intercept || !slope || *slope == 0) {
    description.calibration = "its values are calibrated by ImageJ with c0 = '" + shown(c0.value_or("")) +
                              "' and c1 = '" + shown(c1.value_or("")) + "'; two numbers expected, the second not 0";
    return;
  }
  description.intercept = *intercept;
  description.slope = *slope;
}

TiffDescription of_imagej(const std::string& text) {
  TiffDescription description;
  for (const char* name : {"channels", "frames"})
    if (const long count = number_behind("\n" + text, std::string("\n") + name + "="); count > 1) {
      description.other_pages = formatted("an ImageJ stack of {} {}", count, name);
      break;
    }
  if (const auto images = line_behind(text, "images"))
    description.pages = std::uint64_t(std::max(0L, std::atol(images->c_str())));
  read_calibration(text, description);
  return description;
}

/// Whether it is a description of OME, with any namespace prefix.
bool is_ome(const std::string& text) {
  return text.find("<OME") != std::string::npos || text.find("openmicroscopy.org") != std::string::npos;
}

std::string of_tifffile(const std::string& text, std::uint64_t& samples) {
  const std::size_t begin = text.find('[', text.find(kShape)), end = text.find(']', begin);
  if (end == std::string::npos) return {};
  const std::string shape = text.substr(begin, end - begin + 1);
  int dimensions = 0;
  double product = 1;
  for (const char* at = shape.c_str() + 1; *at;) {
    char* stop = nullptr;
    if (const long length = std::strtol(at, &stop, 10); length > 1) ++dimensions, product *= double(length);
    at = stop == at ? at + 1 : stop;
  }
  samples = product < 1e15 ? std::uint64_t(product) : 0;
  if (dimensions > 3) return formatted("an array of {} dimensions, {}", dimensions, shown(shape));
  const std::size_t key = text.find("\"axes\": \"");
  const std::string axes = key == std::string::npos ? "" : text.substr(key + 9, text.find('"', key + 9) - (key + 9));
  if (dimensions == 3 && axes.size() == 3 && (axes[0] == 'T' || axes[0] == 'C'))
    return std::string("a stack of ") + (axes[0] == 'T' ? "times" : "channels");
  return {};
}

}  // namespace

TiffDescription read_tiff_description(const std::string& text) {
  TiffDescription description;
  if (text.starts_with("ImageJ=")) description = of_imagej(text);
  if (is_ome(text)) description = read_ome_description(text);
  if (text.starts_with("{") && text.find(kShape) != std::string::npos) {
    description.other_pages = of_tifffile(text, description.samples);
    description.is_truncated = text.find("\"truncated\": true") != std::string::npos;
  }
  return description;
}

}  // namespace marrow::files
