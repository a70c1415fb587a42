// SPDX-License-Identifier: Apache-2.0
// The requests of the page "Place".
#include <algorithm>
#include <cmath>
#include <cstring>

#include "marrow/base/printable.hpp"
#include "report/report.hpp"
#include "workbench/place.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

constexpr int kCoarsest_px = 16;
/// Poses that are only judged, at each pause, are not shown among the files of the folder.
constexpr const char* kHidden = ".marrow/placed";

/// What a request wants to see of a bone in a view.
struct OverlayWish {
  const View* view = nullptr;
  const PlacedBone* bone = nullptr;
  RigidTransform world_from_model;
  int step_px = 1;
  std::string what = "radiograph";  ///< radiograph, edges (how fast the radiograph changes) or outline
};

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

/// The mean of each square of `step` pixels, as CV_32F; a rest at the right and below is left out.
cv::Mat means_of_squares(const cv::Mat& pixels, int step) {
  cv::Mat grey;
  pixels.convertTo(grey, CV_32F);
  if (step == 1) return grey;
  cv::Mat means = cv::Mat::zeros(grey.rows / step, grey.cols / step, CV_32F);
  for (int row = 0; row < means.rows * step; ++row)
    for (int column = 0; column < means.cols * step; ++column)
      means.at<float>(row / step, column / step) += grey.at<float>(row, column) / float(step * step);
  return means;
}

/// The grid of the drawn image, one pixel for each square of `step` pixels, cut to a region.
PixelGrid drawn_grid(const PixelGrid& region, int step) {
  PixelGrid grid;
  if (region.count() == 0) return grid;
  const double middle = 0.5 * (step - 1);  // of a square
  const auto first = [&](double from) { return std::max(0., std::floor((from - middle) / step)); };
  const double column = first(region.u_px), row = first(region.v_px);
  grid.step_px = step;
  grid.u_px = column * step + middle;
  grid.v_px = row * step + middle;
  grid.columns = int(std::ceil((region.u_px + region.step_px * (region.columns - 1) - grid.u_px) / step)) + 1;
  grid.rows = int(std::ceil((region.v_px + region.step_px * (region.rows - 1) - grid.v_px) / step)) + 1;
  return grid;
}

/// The length of the gradient, in mm per pixel of the grid, as a fraction of `largest`.
std::string edges_of(const std::vector<float>& values, const PixelGrid& grid, double largest) {
  std::string bytes(values.size(), '\0');
  const std::size_t columns = std::size_t(grid.columns);
  for (int row = 1; row + 1 < grid.rows; ++row)
    for (std::size_t at = std::size_t(row) * columns + 1; at + 1 < (std::size_t(row) + 1) * columns; ++at) {
      const float du = values[at + 1] - values[at - 1], dv = values[at + columns] - values[at - columns];
      bytes[at] = char(std::min(255., 255 * std::sqrt(double(du * du + dv * dv)) / largest));
    }
  return bytes;
}

std::string outline_bytes(const OverlayWish& wish, json& about) {
  const auto points = wish.bone->outline->outline(wish.view->camera, wish.world_from_model, wish.step_px);
  std::vector<float> places;
  for (const OutlinePoint& point : points) places.insert(places.end(), {point.u_px, point.v_px});
  about = {{"points", points.size()}};
  return bytes_of_items(places);
}

/// The part of the image that shows the bone: 8 bit for each pixel of a grid, or for an outline pairs of float (u, v).
/// `about` becomes {u_px, v_px, step_px, columns, rows} of the grid, or {points}.
std::string overlay_bytes(const OverlayWish& wish, json& about) {
  if (wish.what == "outline") return outline_bytes(wish, about);
  if (wish.what != "radiograph" && wish.what != "edges")
    throw Error("'what' must be radiograph, edges or outline, got " + in_quotes(printable(wish.what)));
  const Camera& camera = wish.view->camera;
  const PixelGrid grid = drawn_grid(wish.bone->radiograph->region(camera, wish.world_from_model), wish.step_px);
  about = {{"u_px", grid.u_px},
           {"v_px", grid.v_px},
           {"step_px", grid.step_px},
           {"columns", grid.columns},
           {"rows", grid.rows}};
  if (grid.count() == 0) return "";
  const std::vector<float> values = wish.bone->radiograph->radiograph(camera, wish.world_from_model, grid);
  constexpr double kSteepest = 0.2;  // of the brightest value, from pixel to pixel
  if (wish.what == "edges") return edges_of(values, grid, kSteepest * wish.bone->brightest_mm);
  std::string bytes(values.size(), '\0');
  const float factor = float(255 / wish.bone->brightest_mm);
  for (std::size_t i = 0; i < values.size(); ++i) bytes[i] = char(int(std::min(255.f, factor * values[i])));
  return bytes;
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

/// {contour: {value, views: {NAME: value}}, grey_values: {...}} of a bone: smaller is better.
json costs_of(const PlacedCase& placed, const PlacedBone& bone, const RigidTransform& world_from_model) {
  json costs;
  for (const auto& [name, cost] : {std::pair("contour", &bone.contour), std::pair("grey_values", &bone.grey_values)}) {
    json views = json::object();
    for (std::size_t i = 0; i < std::min((*cost)->view_count(), placed.views.size()); ++i)
      views[placed.views.name(i)] = (*cost)->value_in_view(i, world_from_model);
    costs[name] = {{"value", (*cost)->value(world_from_model)}, {"views", std::move(views)}};
  }
  return costs;
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

std::string number_bytes(const View& view, const View& like, int step_px) {
  cv::Mat small = means_of_squares(view.image.pixels, step_px), numbers;
  double offset = 0, scale = 1;
  if (view.image.pixels.depth() == CV_32F) {
    const cv::Mat is_finite = cv::abs(like.image.pixels) <= 1e30f;  // false for NaN and infinities
    double most = 0;
    cv::minMaxLoc(like.image.pixels, &offset, &most, nullptr, nullptr, is_finite);
    if (most > offset) scale = (most - offset) / 65535;
    cv::patchNaNs(small, offset);
  }
  small.convertTo(numbers, CV_16U, 1 / scale, -offset / scale);
  return bytes_of_pixels(numbers);
}

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
