// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about label maps: reading one, its slices on the grid of the CT, and that grid where
// there is no CT.
#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include "marrow/toolbox/files/label_file.hpp"
#include "workbench/ct.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

// A label map that the page "Case" shows over the slices of a CT.

/// One byte pair a voxel says which segment it belongs to. Where segments overlap, it is the first of them.
struct OpenLabels {
  struct Segment {
    int number = 0;
    std::string name;  ///< empty if the file does not name it
    std::size_t voxels = 0;
    Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< the voxel of it that is nearest to its centre of mass
    nlohmann::json label;  ///< its `label` in a case: a name or a number; null if neither says which segment it is
  };
  std::string name;  ///< unique while the server runs
  Grid grid;
  std::vector<Segment> segments;
  std::vector<std::uint16_t> places;  ///< for each voxel: 0, or 1 + the index of its segment
};

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

/// Throws Error if it has more than 1000 segments: then it is no segmentation of a body.
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

/// {name, grid: {size, spacing_mm}, segments: [{number, name, label, volume_ml, middle_mm}]}
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

/// The places of the nearest voxels in one slice of a CT, as uint16 in the order of slice_of(); 0 outside of the label
/// map's grid.
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

constexpr std::size_t kMostLabelMaps = 2;
constexpr float kAir_hu = -1000;

/// The label maps that were used last.
class LabelMemory {
 public:
  std::shared_ptr<const OpenLabels> by_content(const std::string& content) {
    const std::lock_guard lock(mutex_);
    for (const auto& [known, labels] : kept_)
      if (known == content) return labels;
    return nullptr;
  }
  std::shared_ptr<const OpenLabels> by_name(const std::string& name) {
    const std::lock_guard lock(mutex_);
    for (const auto& [content, labels] : kept_)
      if (labels->name == name) return labels;
    throw Conflict("this label map is no longer in memory; it is opened again");
  }
  std::shared_ptr<const OpenLabels> add(const std::string& content, OpenLabels labels) {
    const std::lock_guard lock(mutex_);
    labels.name = formatted("labels-{}", ++count_);
    kept_.emplace_back(content, std::make_shared<const OpenLabels>(std::move(labels)));
    if (kept_.size() > kMostLabelMaps) kept_.pop_front();
    return kept_.back().second;
  }

 private:
  std::mutex mutex_;
  std::deque<std::pair<std::string, std::shared_ptr<const OpenLabels>>> kept_;
  int count_ = 0;
};

std::shared_ptr<const OpenLabels> opened(const fs::path& place, const CtMemory& cts, LabelMemory& memory) {
  const FilesOfCt files(place);
  const std::string content = content_of_ct(place, json::object(), files);
  if (auto known = memory.by_content(content)) return known;
  cts.check_size(files.bytes);
  return memory.add(content, open_labels(files::read_label_file(place)));
}

/// For want of a CT: air on the grid of the labels, so that there are slices to show them over.
std::shared_ptr<const OpenCt> air(const OpenLabels& labels, CtMemory& memory) {
  const std::string content = "air around " + labels.name;
  if (auto known = memory.by_content(content)) return known;
  return memory.add(
      content,
      Value::of(std::make_shared<const Volume>(Volume{labels.grid, std::vector<float>(labels.grid.count(), kAir_hu)})));
}

}  // namespace

void add_label_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory) {
  const auto kept = std::make_shared<LabelMemory>();
  server.post("/api/labels/open", [&workbench, memory, kept](const Request& request) {
    const std::string file = request.text("labels");
    const fs::path place = workbench.folder.inside(file);
    const bool has_ct = request.body.value("has_ct", true);
    const std::string command = command_of(NodeCall{"read.labels", {{"path", file}}});
    const std::string job = workbench.jobs.start("Reading the labels", command, [memory, kept, place, has_ct](Job&) {
      const auto labels = opened(place, *memory, *kept);
      json answer = about_labels(*labels);
      if (!has_ct) answer["ct"] = about_ct(*air(*labels, *memory));
      return answer;
    });
    return json_answer({{"job", job}, {"command", command}});
  });
  server.get("/api/labels/slice", [memory, kept](const Request& request) {
    const auto labels = kept->by_name(request.parameter("labels"));
    const auto ct = memory->by_name(request.parameter("ct"));
    const int axis = request.number("axis", 0, 2);
    const int last = ct->volume().grid.size[std::size_t(axis)] - 1;
    return bytes_answer(
        bytes_of_items(labels_in_slice(*labels, ct->volume().grid, axis, request.number("index", 0, last))));
  });
}

}  // namespace marrow::workbench
