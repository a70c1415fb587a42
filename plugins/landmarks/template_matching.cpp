// SPDX-License-Identifier: Apache-2.0
// Points by comparing pictures: around the place where the start shows a point, a square of the fragment's radiograph
// is moved over the X-ray image, and turned a little in its plane. The point is where they correlate best (normalised
// cross-correlation: Lewis, Fast normalized cross-correlation, Vision Interface 1995).
#include <tbb/parallel_for.h>

#include <cmath>
#include <marrow/plugin.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "marrow/toolbox/image/grey_values.hpp"

namespace {

using namespace marrow;

struct Options {
  double patch_mm = 40, reach_mm = 15, pixel_mm = 0.8;
  double turn_deg = 8, turn_step_deg = 4;
  double least = 0.5;
  double deviation_factor = 1;
};

/// The image and the radiograph at the start, both at the pixels of one grid. Both are smoothed alike, or a wrong turn
/// would correlate best.
struct Compared {
  PixelGrid grid;
  double pixel_mm = 0;        ///< of the grid, at the bone
  cv::Mat image, radiograph;  ///< CV_32F
};

/// Distance of the points' middle from the source along the central ray.
double depth_of(const Landmarks& points, const View& view, const RigidTransform& world_from_model) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& point : points.points) middle += point.model_mm / double(points.points.size());
  const double depth = (view.camera.camera_from_world * (world_from_model * middle)).z();
  if (!(depth > 0))
    throw Error("view '" + view.name + "': the start puts the points behind the source; is it in the world's frame?");
  return depth;
}

/// Pixels that the mask leaves out get the mean of the others.
cv::Mat values_of(const View& view) {
  if (view.image.pixels.empty()) throw Error("view '" + view.name + "' has no image");
  if (view.image.pixels.type() == CV_32F && !cv::checkRange(view.image.pixels))
    throw Error("view '" + view.name + "': the image holds pixels that are not finite (NaN or infinity)");
  cv::Mat values = image::line_integrals(view.image.pixels);
  if (!view.mask.empty()) values.setTo(cv::mean(values, view.mask)[0], view.mask == 0);
  return values;
}

/// The picture at the pixels of a grid.
cv::Mat at_pixels(cv::Mat picture, const PixelGrid& grid) {
  if (grid.step_px > 1) cv::GaussianBlur(picture, picture, {}, 0.5 * grid.step_px);
  const cv::Matx23d picture_from_grid(grid.step_px, 0, grid.u_px, 0, grid.step_px, grid.v_px);
  cv::Mat result;
  cv::warpAffine(picture, result, picture_from_grid, {grid.columns, grid.rows}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_REPLICATE);
  return result;
}

cv::Mat radiograph_of(const View& view, const RadiographProjector& projector, const RigidTransform& world_from_model) {
  const cv::Size size = view.image.pixels.size();
  std::vector<float> drawn =
      projector.radiograph(view.camera, world_from_model, PixelGrid{0, 0, 1, size.width, size.height});
  return cv::Mat(size, CV_32F, drawn.data()).clone();
}

Compared compared(const Landmarks& points, const View& view, const RadiographProjector& projector,
                  const RigidTransform& world_from_model, const Options& options) {
  const double pixel_mm = depth_of(points, view, world_from_model) / view.camera.intrinsics(0, 0),
               step = std::max(1.0, options.pixel_mm / pixel_mm);
  Compared made;
  made.grid = {0.5 * (step - 1), 0.5 * (step - 1), step, int(view.image.width() / step),
               int(view.image.height() / step)};
  made.pixel_mm = step * pixel_mm;
  if (made.grid.count() == 0) return made;
  made.image = at_pixels(values_of(view), made.grid);
  made.radiograph = at_pixels(radiograph_of(view, projector, world_from_model), made.grid);
  return made;
}

/// A square of an image about a place, turned by an angle; sub-pixel, and zero outside.
cv::Mat square_of(const cv::Mat& image, const Eigen::Vector2d& middle, int side, double angle_rad) {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), half = 0.5 * (side - 1);
  const cv::Matx23d image_from_square(c, -s, middle.x() - c * half + s * half, s, c, middle.y() - s * half - c * half);
  cv::Mat square;
  cv::warpAffine(image, square, image_from_square, {side, side}, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                 cv::BORDER_CONSTANT);
  return square;
}

struct Match {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< in pixels of the grid
  double correlation = 0, deviation = 0;
};

/// The highest correlation, by parabolas through its neighbours. Absent if it lies on the border of what was searched.
///
/// The deviation follows from the peak's curvature k. If the image is the radiograph with noise, the error bound of
/// Cramer and Rao is (1 - c^2) / (c n k) for a correlation c of n independent pixels. What differs here is other
/// tissue, as smooth as the bone: so a pixel is taken as independent of those beyond the peak's width, sqrt(2 / k).
std::optional<Match> peak_of(const cv::Mat& correlation, int side) {
  double highest = 0;
  cv::Point at;
  cv::minMaxLoc(correlation, nullptr, &highest, nullptr, &at);
  if (at.x < 1 || at.y < 1 || at.x >= correlation.cols - 1 || at.y >= correlation.rows - 1) return std::nullopt;
  Match match;
  match.correlation = highest;
  double variance = 0;
  for (int axis = 0; axis < 2; ++axis) {
    const cv::Point step(axis == 0, axis == 1);
    const double before = correlation.at<float>(at - step), after = correlation.at<float>(at + step);
    const double curvature = 2 * highest - before - after;
    if (!(curvature > 0)) return std::nullopt;
    match.shift[axis] = (axis == 0 ? at.x : at.y) + 0.5 * (after - before) / curvature;
    variance += 0.5 * 2 * kPi * (1 - highest * highest) / (highest * side * side * curvature * curvature);
  }
  match.deviation = std::sqrt(variance);
  return match;
}

/// The best match over all turns. Absent if the point is out of view, or nothing correlates enough.
std::optional<Match> matched(const Compared& compared, const Eigen::Vector2d& place, const Options& options) {
  const int side = std::max(5, int(std::lround(options.patch_mm / options.pixel_mm))),
            reach = std::max(1, int(std::lround(options.reach_mm / options.pixel_mm)));
  constexpr float kConstant = 1e-6f;
  const cv::Mat window = square_of(compared.image, place, side + 2 * reach, 0);
  std::optional<Match> best;
  const int turns = options.turn_step_deg > 0 ? int(options.turn_deg / options.turn_step_deg) : 0;
  for (int turn = -turns; turn <= turns; ++turn) {
    const cv::Mat patch = square_of(compared.radiograph, place, side, radians(turn * options.turn_step_deg));
    cv::Scalar mean, deviation;
    cv::meanStdDev(patch, mean, deviation);
    if (!(deviation[0] > kConstant)) continue;
    cv::Mat correlation;
    cv::matchTemplate(window, patch, correlation, cv::TM_CCOEFF_NORMED);
    const auto peak = peak_of(correlation, side);
    if (peak && peak->correlation >= options.least && (!best || peak->correlation > best->correlation)) best = peak;
  }
  if (best) best->shift -= Eigen::Vector2d(reach, reach);
  return best;
}

Landmarks matched_landmarks(const Landmarks& points, const List<View>& views, const RadiographProjector& projector,
                            const Pose& start, const Options& options, Context& context) {
  if (points.points.empty()) throw Error("there are no points to look for; give their places in the CT");
  check_pose(start, "the start");
  Landmarks result = points;
  result.seen.clear();
  for (std::size_t v = 0; v < views.size(); ++v) {
    const View& view = views[v];
    check_view(view);
    context.check_cancelled();
    const Compared both = compared(points, view, projector, start.world_from_model, options);
    if (both.grid.count() == 0) continue;
    std::vector<std::optional<Landmarks::Seen>> found(points.points.size());
    tbb::parallel_for(std::size_t(0), found.size(), [&](std::size_t i) {
      const Eigen::Vector2d pixel = project(view.camera, start.world_from_model * points.points[i].model_mm);
      const Eigen::Vector2d place = (pixel - both.grid.pixel(0, 0)) / both.grid.step_px;
      if (!place.allFinite() || place.x() < 0 || place.y() < 0 || place.x() > both.grid.columns - 1 ||
          place.y() > both.grid.rows - 1)
        return;
      if (const auto match = matched(both, place, options))
        found[i] = Landmarks::Seen{points.points[i].name, views.name(v), pixel + both.grid.step_px * match->shift,
                                   options.deviation_factor * both.grid.step_px * match->deviation};
    });
    for (const auto& one : found)
      if (one) result.seen.push_back(*one);
  }
  if (result.seen.empty())
    context.warn("no view shows what the radiograph at the start shows; is the start near enough?");
  return result;
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.node("landmarks.template_matching", matched_landmarks)
      .summary("Named points where the image around them correlates best with the fragment's radiograph at the start")
      .in("points", "points in CT coordinates")
      .in("views", "X-ray views", over("view"))
      .in("projector", "makes radiographs of the fragment")
      .in("start", "where the fragment is, to within reach_mm and about 10 degrees")
      .out("landmarks", "the same points, with the pixel and the deviation of those that each view shows")
      .option("patch_mm", &Options::patch_mm, "side of the square that is compared, at the bone", at_least(5),
              at_most(300))
      .option("reach_mm", &Options::reach_mm, "how far a point may be from where the start shows it, at the bone",
              at_least(1), at_most(200))
      .option("pixel_mm", &Options::pixel_mm,
              "size of the pixels that are compared, at the bone; not below the image's", at_least(0.1), at_most(5))
      .option("turn_deg", &Options::turn_deg, "the radiograph is turned by up to this angle in its plane", at_least(0),
              at_most(45))
      .option("turn_step_deg", &Options::turn_step_deg, "in steps of this angle; 0: it is not turned", at_least(0),
              at_most(45))
      .option("least", &Options::least, "a point is not seen where the highest correlation is below this", at_least(0),
              at_most(1))
      .option("deviation_factor", &Options::deviation_factor, "the stated deviations are multiplied by this",
              at_least(0.01), at_most(100));
}
