// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about label maps: reading one, its slices on the grid of the CT, and that grid where
// there is no CT.
#include <deque>
#include <mutex>

#include "marrow/base/number_text.hpp"
#include "workbench/ct_requests.hpp"
#include "workbench/open_labels.hpp"
#include "workbench/value_json.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

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
