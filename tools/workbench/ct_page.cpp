// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Case" about its CT: reading it, and its slices.
#include "marrow/base/printable.hpp"
#include "workbench/ct_memory.hpp"
#include "workbench/ct_requests.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The options of a CT that a case may give beside its file.
constexpr const char* kOptions[] = {"voxel_size_mm", "flip", "value_offset_hu", "series_uid"};

NodeCall call_of(const fs::path& place, const json& ct) {
  NodeCall call{"read.volume", {{"path", place.string()}}};
  for (const char* option : kOptions)
    if (ct.contains(option)) call.options.emplace_back(option, ct[option]);
  return call;
}

/// Reads it unless it is in memory already.
std::shared_ptr<const OpenCt> opened(const fs::path& place, const json& ct, Workbench& workbench, CtMemory& memory,
                                     Job& job) {
  std::unique_lock reading(memory.reading(), std::defer_lock);
  while (!reading.try_lock_for(std::chrono::milliseconds(100)))
    if (job.stopped()) throw Error("stopped");
  const FilesOfCt files(place);
  const std::string content = content_of_ct(place, ct, files);
  if (auto known = memory.by_content(content)) return known;
  memory.check_size(files.bytes);
  auto outputs = outputs_of(call_of(place, ct), workbench, job);
  return memory.add(content, std::move(outputs.at("volume")));
}

}  // namespace

void add_ct_reading(Server& server, Workbench& workbench, const std::shared_ptr<CtMemory>& memory) {
  server.post("/api/ct/open", [&workbench, memory](const Request& request) {
    json ct = request.body.value("ct", json());
    if (!ct.is_object() || !ct.contains("file") || !ct["file"].is_string())
      throw Error("the request names no file of a CT");
    const std::string file = ct["file"];
    const fs::path place = workbench.folder.inside(file);
    const std::string job = workbench.jobs.start(
        "Reading the CT", command_of(call_of(file, ct)),
        [&workbench, memory, place, ct](Job& job) { return about_ct(*opened(place, ct, workbench, *memory, job)); });
    return json_answer({{"job", job}, {"command", command_of(call_of(file, ct))}});
  });
  server.get("/api/ct/slice", [memory](const Request& request) {
    const auto ct = memory->by_name(request.parameter("ct"));
    const int axis = request.number("axis", 0, 2);
    return bytes_answer(
        slice_of(ct->volume(), axis, request.number("index", 0, ct->volume().grid.size[std::size_t(axis)] - 1)));
  });
}

void add_ct_page(Server& server, Workbench& workbench) {
  const auto memory = std::make_shared<CtMemory>();
  add_ct_reading(server, workbench, memory);
  add_label_reading(server, workbench, memory);
  add_segmenting(server, workbench, memory);
  add_saving(server, workbench, memory);
}

}  // namespace marrow::workbench
