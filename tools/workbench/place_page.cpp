// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Place".
#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "report/report.hpp"
#include "workbench/place.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr int kCoarsest_px = 16;
/// Poses that are only judged, at each pause, are not shown among the files of the folder.
constexpr const char* kHidden = ".marrow/placed";

/// What the page needs of an opened case.
json about_case(const PlacedCase& placed) {
  json views = json::array(), bones = json::array();
  for (std::size_t i = 0; i < placed.views.size(); ++i)
    views.push_back({{"name", placed.views.name(i)}, {"camera", json_of(placed.views[i].camera)}});
  for (const PlacedBone& bone : placed.bones)
    bones.push_back({{"name", bone.name},
                     {"middle_mm", json_of(bone.frame.origin_mm)},
                     {"long_axis", json_of(Eigen::Vector3d(bone.frame.axes.col(2)))},
                     {"start", json_of(bone.start)},
                     {"start_is", bone.start_is}});
  return {{"case", placed.path}, {"views", views}, {"bones", bones}};
}

const json& object_in(const Request& request, const char* name) {
  const auto found = request.body.find(name);
  if (found == request.body.end() || !found->is_object())
    throw Error("the request lacks '" + std::string(name) + "', an object");
  return *found;
}

int step_in(const Request& request) {
  const json step = request.body.value("step_px", json(1));
  if (!step.is_number_integer() || step < 1 || step > kCoarsest_px)
    throw Error(formatted("'step_px' must be a whole number from 1 to {}", kCoarsest_px));
  return step.get<int>();
}

/// The bones of a view one after the other: bytes, and in `about` {layers: [{bone, bytes, ...}]}.
Answer overlay(const PlacedCase& placed, const Request& request) {
  OverlayWish wish;
  wish.view = &placed.view(request.text("view"));
  wish.what = request.text("what");
  wish.step_px = step_in(request);
  std::string bytes;
  json layers = json::array();
  for (const auto& [name, pose] : poses_in(request)) {
    wish.bone = &placed.bone(name);
    wish.world_from_model = pose;
    json about;
    const std::string layer = overlay_bytes(wish, about);
    about["bone"] = name;
    about["bytes"] = layer.size();
    layers.push_back(std::move(about));
    bytes += layer;
  }
  return bytes_answer(std::move(bytes), {{"layers", layers}});
}

/// Begins a job that runs a pipeline from the poses of the request.
json start_from(const Request& request, const PlacedCase& placed, Workbench& workbench, const std::string& title,
                const std::string& into, const std::filesystem::path& pipeline, const std::string& shown) {
  const std::string starts = write_placement(workbench.folder, into, placed, start_files(placed, poses_in(request)));
  const std::string command = command_from_starts(workbench, shown, placed.path, starts);
  const std::string job =
      workbench.jobs.start(title, command, [&workbench, pipeline, path = placed.path, starts](Job& j) {
        return run_from_starts(workbench, pipeline, path, starts, j);
      });
  return {{"job", job}, {"command", command}};
}

}  // namespace

std::map<std::string, RigidTransform> poses_in(const Request& request, const char* name) {
  std::map<std::string, RigidTransform> poses;
  for (const auto& [bone, matrix] : object_in(request, name).items()) poses[bone] = placement_of(matrix);
  return poses;
}

void add_place_page(Server& server, Workbench& workbench) {
  const auto cases = std::make_shared<PlacedCases>();
  add_place_frames(server, workbench, cases);
  add_place_tracking(server, workbench, cases);
  server.post("/api/place/open", [&workbench, cases](const Request& request) {
    const std::string path = request.text("case");
    workbench.folder.inside(path);
    const std::string job = workbench.jobs.start("Opening the case", "", [&workbench, cases, path](Job& running) {
      const auto placed = open_case(path, workbench, running);
      cases->keep(placed);
      json about = about_case(*placed);
      about["pipelines"] = pipelines_from_starts(workbench);
      return about;
    });
    return json_answer({{"job", job}});
  });
  server.get("/api/place/image", [cases](const Request& request) {
    const auto placed = cases->find(request.parameter("case"));
    const int step_px = request.number("step_px", 1, kCoarsest_px);
    const View& view = placed->view(request.parameter("view"));
    return bytes_answer(number_bytes(view, view, step_px));
  });
  server.post("/api/place/overlay",
              [cases](const Request& request) { return overlay(*cases->find(request.text("case")), request); });
  server.post("/api/place/costs", [cases](const Request& request) {
    const auto placed = cases->find(request.text("case"));
    json costs = json::object();
    for (const auto& [name, pose] : poses_in(request)) costs[name] = costs_of(*placed, placed->bone(name), pose);
    return json_answer(costs);
  });
  server.post("/api/place/verdict", [&workbench, cases](const Request& request) {
    const std::filesystem::path file = workbench_pipeline("place_verdict");
    return json_answer(
        start_from(request, *cases->find(request.text("case")), workbench, "Verdict", kHidden, file, file.string()));
  });
  server.post("/api/place/register", [&workbench, cases](const Request& request) {
    const std::string pipeline = request.text("pipeline");
    const json known = pipelines_from_starts(workbench);
    if (std::none_of(known.begin(), known.end(), [&](const json& one) { return one["file"] == pipeline; }))
      throw Error("this pipeline cannot start from a placement; choose one of the list");
    return json_answer(start_from(request, *cases->find(request.text("case")), workbench, "Registration", "placed",
                                  workbench.folder.path() / pipeline, pipeline));
  });
}

}  // namespace marrow::workbench
