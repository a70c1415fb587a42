// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/exchange/marked_values.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"
#include "marrow/base/names.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"

namespace marrow::exchange {
namespace {

/// "distal" of "distal-1", "distal_1" and "distal 1".
std::string without_number(const std::string& label) {
  const std::size_t last = label.find_last_not_of("0123456789");
  if (last == std::string::npos || last + 1 == label.size()) return label;
  const bool is_number = last > 0 && (label[last] == '-' || label[last] == '_' || label[last] == ' ');
  return is_number ? label.substr(0, last) : label;
}

[[noreturn]] void refuse(const std::filesystem::path& path, std::size_t index, const std::string& what) {
  throw Error(formatted("{}: point {}: {}", path.string(), index + 1, what));
}

void check_label(const std::filesystem::path& path, std::size_t index, const std::string& name,
                 const std::string& advice) {
  if (name.empty()) refuse(path, index, "it has no label; " + advice);
  if (const std::string fault = fault_of_item_name(name); !fault.empty())
    refuse(path, index, "its label " + in_quotes(printable(name)) + " " + fault + "; " + advice);
}

MarkedPoint finite(const std::string& label, const Eigen::Vector3d& at_mm) {
  if (!at_mm.allFinite())
    throw Error("point " + in_quotes(printable(label)) + " has a coordinate that is not a finite number");
  return {label, at_mm};
}

}  // namespace

Landmarks read_marked_landmarks(const std::filesystem::path& path) {
  Landmarks landmarks;
  for (const MarkedPoint& point : read_markups(path)) {
    const std::size_t index = landmarks.points.size();
    check_label(path, index, point.label, "give each point its landmark's name in 3D Slicer");
    const auto other = std::find_if(landmarks.points.begin(), landmarks.points.end(),
                                    [&](const auto& known) { return known.name == point.label; });
    if (other != landmarks.points.end())
      refuse(path, index,
             formatted("its label '{}' is that of point {}; give each its own", printable(point.label),
                       other - landmarks.points.begin() + 1));
    landmarks.points.push_back({point.label, point.at_mm});
  }
  return landmarks;
}

List<Seeds> read_marked_seeds(const std::filesystem::path& path, const std::string& fragment) {
  std::vector<Seeds> fragments;
  std::size_t index = 0;
  for (const MarkedPoint& point : read_markups(path)) {
    const std::string name = fragment.empty() ? without_number(point.label) : fragment;
    check_label(path, index++, name, "give it its fragment's name in 3D Slicer, or give fragment");
    auto found = std::find_if(fragments.begin(), fragments.end(), [&](const Seeds& s) { return s.fragment == name; });
    if (found == fragments.end()) found = fragments.insert(fragments.end(), Seeds{name, {}});
    found->points_mm.push_back(point.at_mm);
  }
  List<Seeds> seeds;
  for (Seeds& one : fragments) {
    const std::string name = one.fragment;
    seeds.add(name, std::move(one));
  }
  return seeds;
}

std::vector<MarkedPoint> marked_points(const Landmarks& landmarks) {
  std::vector<MarkedPoint> points;
  for (const Landmarks::Point& point : landmarks.points) points.push_back(finite(point.name, point.model_mm));
  return points;
}

std::vector<MarkedPoint> marked_points(const Seeds& seeds) {
  std::vector<MarkedPoint> points;
  for (const Eigen::Vector3d& point : seeds.points_mm)
    points.push_back(finite(formatted("{}-{}", seeds.fragment, points.size() + 1), point));
  return points;
}

}  // namespace marrow::exchange
