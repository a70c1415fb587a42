// SPDX-License-Identifier: Apache-2.0
// What the page "Place" draws: X-ray images, and bones as a camera sees them.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "marrow/base/error.hpp"
#include "marrow/base/printable.hpp"
#include "workbench/place.hpp"

namespace marrow::workbench {
namespace {

using nlohmann::json;

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

}  // namespace marrow::workbench
