// SPDX-License-Identifier: Apache-2.0
#include "workbench/open_labels.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "workbench/value_json.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr std::size_t kMostSegments = 1000;

/// Calls action(voxel, i) for each voxel of segment i, with the voxel's index.
template <class Action>
void for_each_marked(const OpenLabels& labels, const Action& action) {
  std::size_t at = 0;
  for (int z = 0; z < labels.grid.size[2]; ++z)
    for (int y = 0; y < labels.grid.size[1]; ++y)
      for (int x = 0; x < labels.grid.size[0]; ++x, ++at)
        if (labels.places[at]) action(Eigen::Vector3d(x, y, z), std::size_t(labels.places[at] - 1));
}

void find_middles(OpenLabels& labels) {
  const std::size_t count = labels.segments.size();
  std::vector<Eigen::Vector3d> centre(count, Eigen::Vector3d::Zero()), middle = centre;
  std::vector<double> least(count, std::numeric_limits<double>::infinity());
  for_each_marked(labels, [&](const Eigen::Vector3d& voxel, std::size_t i) {
    centre[i] += voxel;
    ++labels.segments[i].voxels;
  });
  for (std::size_t i = 0; i < count; ++i) centre[i] /= std::max(1.0, double(labels.segments[i].voxels));
  for_each_marked(labels, [&](const Eigen::Vector3d& voxel, std::size_t i) {
    const double away = (voxel - centre[i]).cwiseProduct(labels.grid.spacing_mm).squaredNorm();
    if (away >= least[i]) return;
    least[i] = away;
    middle[i] = voxel;
  });
  for (std::size_t i = 0; i < count; ++i) labels.segments[i].middle_mm = labels.grid.point_from_index(middle[i]);
}

/// The name if it is that of one segment only and cannot be taken for a number; else the number, if no other has it.
json label_of(const files::LabelMap& map, const files::Segment& segment) {
  const auto alone = [&](auto member) {
    return std::count_if(map.segments.begin(), map.segments.end(),
                         [&](const auto& other) { return other.*member == segment.*member; }) == 1;
  };
  const bool is_number =
      std::all_of(segment.name.begin(), segment.name.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (!segment.name.empty() && !is_number && alone(&files::Segment::name)) return segment.name;
  if (alone(&files::Segment::number)) return segment.number;
  return nullptr;
}

}  // namespace

OpenLabels open_labels(const files::LabelMap& map) {
  if (map.segments.size() > kMostSegments)
    throw Error(formatted("{}: has {} labels, and at most {} are shown here. Is it a segmentation of a body?",
                          map.path.string(), map.segments.size(), kMostSegments));
  OpenLabels labels;
  labels.grid = map.grid;
  labels.places.resize(map.grid.count());
  for (const files::Segment& segment : map.segments)
    labels.segments.push_back({.number = segment.number, .name = segment.name, .label = label_of(map, segment)});
  for (std::size_t layer = 0; layer < map.layers.size(); ++layer) {
    std::vector<std::uint16_t> place_of(std::size_t(std::numeric_limits<std::uint16_t>::max()) + 1, 0);
    for (std::size_t i = 0; i < map.segments.size(); ++i)
      if (map.segments[i].layer == layer) place_of[std::size_t(map.segments[i].number)] = std::uint16_t(i + 1);
    const std::vector<float>& numbers = map.layers[layer];
    for (std::size_t at = 0; at < numbers.size(); ++at)
      if (numbers[at] != 0 && !labels.places[at]) labels.places[at] = place_of[std::size_t(numbers[at])];
  }
  find_middles(labels);
  return labels;
}

json about_labels(const OpenLabels& labels) {
  const double voxel_ml = labels.grid.spacing_mm.prod() / 1000;
  json segments = json::array();
  for (const OpenLabels::Segment& segment : labels.segments)
    segments.push_back({{"number", segment.number},
                        {"name", segment.name},
                        {"label", segment.label},
                        {"volume_ml", double(segment.voxels) * voxel_ml},
                        {"middle_mm", json_of(segment.middle_mm)}});
  return {{"name", labels.name},
          {"grid", {{"size", labels.grid.size}, {"spacing_mm", json_of(labels.grid.spacing_mm)}}},
          {"segments", segments}};
}

std::vector<std::uint16_t> labels_in_slice(const OpenLabels& labels, const Grid& ct, int axis, int index) {
  const int fast = axis == 0 ? 1 : 0, slow = axis == 2 ? 1 : 2;
  const auto at = [&](int a, int b) {
    Eigen::Vector3d in_ct;
    in_ct[axis] = index;
    in_ct[fast] = a;
    in_ct[slow] = b;
    return labels.grid.index_from_point(ct.point_from_index(in_ct));
  };
  const Eigen::Vector3d first = at(0, 0), step = at(1, 0) - first, row = at(0, 1) - first;
  std::vector<std::uint16_t> places(std::size_t(ct.size[std::size_t(fast)]) * std::size_t(ct.size[std::size_t(slow)]));
  auto place = places.begin();
  for (int b = 0; b < ct.size[std::size_t(slow)]; ++b)
    for (int a = 0; a < ct.size[std::size_t(fast)]; ++a, ++place) {
      const Eigen::Vector3d voxel = first + a * step + b * row;
      std::array<int, 3> nearest;
      bool is_inside = true;
      for (int k = 0; k < 3; ++k) {
        nearest[std::size_t(k)] = int(std::floor(voxel[k] + 0.5));
        is_inside &= nearest[std::size_t(k)] >= 0 && nearest[std::size_t(k)] < labels.grid.size[std::size_t(k)];
      }
      if (is_inside) *place = labels.places[labels.grid.offset(nearest[0], nearest[1], nearest[2])];
    }
  return places;
}

}  // namespace marrow::workbench
