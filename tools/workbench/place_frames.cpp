// SPDX-License-Identifier: Apache-2.0
// The frames of a sequence on the page "Place".
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/runtime/node/types.hpp"
#include "marrow/toolbox/files/sequence_files.hpp"
#include "marrow/toolbox/track/sequence.hpp"
#include "workbench/place_sequence.hpp"
#include "workbench/xray.hpp"

namespace fs = std::filesystem;

namespace marrow::workbench {
namespace {

using nlohmann::json;
using track::SequenceFrame;

std::string text_in(const json& object, const char* name) {
  const auto found = object.find(name);
  return found != object.end() && found->is_string() ? found->get<std::string>() : "";
}

/// Frames from `first` to `last` of a view; `last` 0: to the end.
List<SequenceFrame> read_frames(const Workbench& workbench, const PlacedCase& placed, const ViewFrames& view, int first,
                                int last, Job& job) {
  const auto one = [](const std::string& text) { return json::array({text}); };
  const NodeCall call{"read.sequence",
                      {{"names", one(view.name)},
                       {"images", one(workbench.folder.inside(view.images).string())},
                       {"patterns", one(view.pattern)},
                       {"cameras", one(camera_file_of(workbench, placed, view.name).string())},
                       {"first", first},
                       {"last", last}}};
  return outputs_of(call, workbench, job).at("frames").as_list<SequenceFrame>();
}

/// Some frames of a view as number_bytes(), one after the other; {frames, bytes}, the bytes of each.
Answer frames(const Workbench& workbench, const PlacedCase& placed, const Request& request) {
  constexpr int kMost = 1'000'000, kMostAtOnce = 32, kCoarsest_px = 16;
  ViewFrames view{placed.view(request.parameter("view")).name, request.parameter("images"),
                  request.parameter("pattern")};
  const int first = request.number("first", 1, kMost);
  const int last = request.number("last", first, first + kMostAtOnce - 1);
  const int step_px = request.number("step_px", 1, kCoarsest_px);
  Job job("", "");
  std::string bytes;
  const auto read = read_frames(workbench, placed, view, first, last, job);
  for (const SequenceFrame& frame : read) bytes += number_bytes(frame.views.front(), placed.view(view.name), step_px);
  const json about = {{"frames", read.size()}, {"bytes", bytes.size() / read.size()}};
  return bytes_answer(std::move(bytes), about);
}

}  // namespace

std::vector<ViewFrames> frames_in(const json& views, const PlacedCase& placed) {
  std::vector<ViewFrames> all;
  for (std::size_t i = 0; i < placed.views.size(); ++i) {
    const std::string& name = placed.views.name(i);
    const auto found = views.is_object() ? views.find(name) : views.end();
    const json view = views.is_object() && found != views.end() ? *found : json::object();
    all.push_back({name, text_in(view, "images"), text_in(view, "pattern")});
    if (all.back().images.empty())
      throw Error("view " + in_quotes(printable(name)) +
                  ": say where its frames are: a folder of images, or a file with several frames");
  }
  return all;
}

fs::path camera_file_of(const Workbench& workbench, const PlacedCase& placed, const std::string& view) {
  const json document = document_of_case(workbench.folder, placed.path);
  for (const json& one : document.at("views"))
    if (one.at("name") == view) return camera_file(workbench, one.value("camera", json()), one.at("image"));
  throw Error("case.yaml has no view " + in_quotes(printable(view)) + " any more; open the case again");
}

int count_frames(const Workbench& workbench, const PlacedCase& placed, const std::vector<ViewFrames>& views, Job& job) {
  std::vector<std::size_t> counts;
  for (const ViewFrames& view : views) {
    job.tell({{"event", "message"}, {"text", view.name}});
    const fs::path place = workbench.folder.inside(view.images);
    if (fs::is_directory(place)) {
      counts.push_back(files::frame_files(place, view.pattern).size());
      read_frames(workbench, placed, view, 1, 1, job);  // throws if the images cannot be read
    } else {
      counts.push_back(read_frames(workbench, placed, view, 1, 0, job).size());
    }
    if (counts.back() != counts.front())
      throw Error(formatted("view {} has {} frames, but view {} has {}; all views must show the same moments",
                            in_quotes(printable(view.name)), counts.back(), in_quotes(printable(views.front().name)),
                            counts.front()));
  }
  return int(counts.front());
}

void add_place_frames(Server& server, Workbench& workbench, const std::shared_ptr<PlacedCases>& cases) {
  server.post("/api/place/sequence", [&workbench, cases](const Request& request) {
    const auto placed = cases->find(request.text("case"));
    const auto views = frames_in(request.body.value("views", json()), *placed);
    for (const ViewFrames& view : views) workbench.folder.inside(view.images);
    const std::string job = workbench.jobs.start("Opening the sequence", "", [&workbench, placed, views](Job& running) {
      return json{{"frames", count_frames(workbench, *placed, views, running)}};
    });
    return json_answer({{"job", job}});
  });
  server.get("/api/place/frames", [&workbench, cases](const Request& request) {
    return frames(workbench, *cases->find(request.parameter("case")), request);
  });
}

}  // namespace marrow::workbench
