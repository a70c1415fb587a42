// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <vector>

namespace marrow::compare {

/// The parts of a figure's path, errors.distal.mtre_mm: the output, an item of each of its lists, and the figure, whose
/// name may have dots too.
inline std::vector<std::string> parts_of_path(const std::string& path) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  for (std::size_t dot; (dot = path.find('.', begin)) != std::string::npos; begin = dot + 1)
    parts.push_back(path.substr(begin, dot - begin));
  parts.push_back(path.substr(begin));
  return parts;
}

/// The name of the figure, which begins with the part of this number.
inline std::string figure_from(const std::vector<std::string>& parts, std::size_t first) {
  std::string name;
  for (std::size_t i = first; i < parts.size(); ++i) name += (i == first ? "" : ".") + parts[i];
  return name;
}

}  // namespace marrow::compare
