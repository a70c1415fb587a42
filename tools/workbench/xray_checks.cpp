// SPDX-License-Identifier: Apache-2.0
// The check of the cameras of a draft's views, and the pose that its landmarks give.
#include "workbench/xray.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

/// The views of the request: those that have an image and a camera.
json views_of(const Request& request) {
  const json views = request.body.value("views", json::array());
  if (!views.is_array() || views.empty()) throw Error("there is no view with an image and a camera");
  return views;
}

json landmarks_of(const Request& request) { return request.body.value("landmarks", json::array()); }

json pixels_of(const json& landmark) {
  const json pixels = landmark.value("pixels", json());
  return pixels.is_object() ? pixels : json::object();
}

/// {marrow-points: ...} with the landmarks that two views show; null if there are none.
json points_of(const json& landmarks) {
  json points = json::array();
  for (const json& landmark : landmarks)
    if (const json seen = pixels_of(landmark); seen.size() >= 2)
      points.push_back({{"name", landmark.at("name")}, {"seen_px", seen}});
  return points.empty() ? json() : json{{"marrow-points", 1}, {"points", points}};
}

json checked(const Workbench& workbench, const Request& request) {
  PipelineCall call{workbench_pipeline("check-cameras"), {{}, overrides_of(workbench, views_of(request))}, {"metrics"}};
  const json points = points_of(landmarks_of(request));
  if (!points.is_null())
    call.arguments.overrides.push_back(
        {"check.known_points", set_text(working_file(workbench.folder, "points", ".yaml", points.dump(1)).string())});
  const Ran ran = run(call, workbench);
  json metrics = json::object();
  for (const Metric& metric : ran.outputs.at("metrics").as<Metrics>().items) metrics[metric.name] = metric.value;
  return {{"warnings", ran.warnings}, {"metrics", metrics}, {"command", command_of(call)}};
}

/// The landmarks that have a place in the CT, in the format of landmarks.yaml.
json landmarks_file(const json& landmarks, const std::string& fragment) {
  json points = json::object(), seen = json::object();
  for (const json& landmark : landmarks) {
    if (!landmark.contains("model_mm") || !landmark["model_mm"].is_array()) continue;
    const std::string name = landmark.at("name");
    if (points.contains(name)) throw Error("two landmarks are named '" + name + "'; rename one of them");
    points[name] = landmark["model_mm"];
    const json pixels = pixels_of(landmark);
    for (const auto& [view, pixel] : pixels.items()) seen[view][name] = pixel;
  }
  if (points.size() < 3)
    throw Error(formatted(
        "a pose takes three landmarks that have a place in the CT and that two views show; {} a place in the CT",
        counted(points.size(), "has", "have")));
  if (seen.empty()) throw Error("no view shows a landmark that has a place in the CT; mark them in the X-rays");
  return {{"marrow-landmarks", 1}, {"fragments", {{fragment, {{"points", points}, {"seen", seen}}}}}};
}

/// All triangles between the first points, as PLY: a surface that has the same axes as the points.
std::string surface_of(const json& points) {
  constexpr std::size_t kMost = 12;
  std::string vertices, triangles;
  const std::size_t count = std::min(points.size(), kMost);
  std::size_t faces = 0;
  auto point = points.begin();
  for (std::size_t i = 0; i < count; ++i, ++point)
    vertices += formatted("{:.17g} {:.17g} {:.17g}\n", point->at(0).get<double>(), point->at(1).get<double>(),
                          point->at(2).get<double>());
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = i + 1; k < count; ++k)
      for (std::size_t m = k + 1; m < count; ++m, ++faces) triangles += formatted("3 {} {} {}\n", i, k, m);
  return formatted(
             "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n"
             "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
             count, faces) +
         vertices + triangles;
}

/// The pose from landmarks, and the call that computed it.
struct Fit {
  Pose pose;
  PipelineCall call;
};

Fit fit(const Workbench& workbench, const json& views, const json& landmarks, const std::string& fragment) {
  const json file = landmarks_file(landmarks, fragment);
  const std::string surface = surface_of(file["fragments"][fragment]["points"]);
  Fit fit{{},
          {workbench_pipeline("fit-landmarks"),
           {{{"landmarks", working_file(workbench.folder, "landmarks", ".yaml", file.dump(1)).string()},
             {"model", working_file(workbench.folder, "model", ".ply", surface).string()}},
            overrides_of(workbench, views)}}};
  fit.pose = run(fit.call, workbench).outputs.at("pose").items.at(0).as<Pose>();
  return fit;
}

/// The landmarks in the image of `view` with left and right exchanged.
json mirrored(json landmarks, const std::string& view, double width_px) {
  for (json& landmark : landmarks)
    if (landmark.contains("pixels") && landmark["pixels"].contains(view)) {
      json& u = landmark["pixels"][view][0];
      u = width_px - 1 - u.get<double>();
    }
  return landmarks;
}

/// A sentence about the view whose mirrored image fits best, if it fits at least five times as well as `residual_px`.
std::vector<std::string> mirrored_view(const Workbench& workbench, const json& views, const json& landmarks,
                                       const std::string& fragment, double residual_px) {
  constexpr double kBetter = 5;
  std::string best;
  double least_px = residual_px / kBetter;
  for (const json& view : views) {
    const std::string name = view.at("name");
    try {
      const json other = mirrored(landmarks, name, view.value("width_px", 0.0));
      const double other_px = fit(workbench, views, other, fragment).pose.cost;
      if (other_px >= least_px) continue;
      least_px = other_px;
      best = name;
    } catch (const Error&) {
      // mirrored, the landmarks give no pose, so this image is not mirrored
    }
  }
  if (best.empty()) return {};
  return {formatted("the image of '{}' seems to be mirrored: the other way round, the landmarks fit to {:.2g} px", best,
                    least_px)};
}

json fitted(const Workbench& workbench, const Request& request) {
  constexpr double kDoubtful_px = 3, kNoPose_px = 20;
  const std::string fragment = request.text("fragment");
  const json views = views_of(request), landmarks = landmarks_of(request);
  try {
    const Fit found = fit(workbench, views, landmarks, fragment);
    std::vector<std::string> warnings = found.pose.warnings;
    // A pose may fit because landmarks that contradict it were left out; its warnings name them.
    if (found.pose.cost > kDoubtful_px || !warnings.empty())
      for (const std::string& sentence : mirrored_view(workbench, views, landmarks, fragment, found.pose.cost))
        warnings.push_back(sentence);
    return {{"world_from_ct", json_of(found.pose.world_from_model)},
            {"residual_px", found.pose.cost},
            {"warnings", warnings},
            {"command", command_of(found.call)}};
  } catch (const Error& error) {
    std::string text = error.what();
    for (const std::string& sentence : mirrored_view(workbench, views, landmarks, fragment, kNoPose_px))
      text += "\n" + sentence;
    throw Error(text);
  }
}

}  // namespace

void add_xray_checks(Server& server, Workbench& workbench) {
  server.post("/api/xray/check", [&](const Request& request) { return json_answer(checked(workbench, request)); });
  server.post("/api/xray/fit", [&](const Request& request) { return json_answer(fitted(workbench, request)); });
}

}  // namespace marrow::workbench
