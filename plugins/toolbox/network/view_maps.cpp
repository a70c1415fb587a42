// SPDX-License-Identifier: Apache-2.0
// From a view to the network's pixels and back.
#include <algorithm>
#include <cmath>
#include <marrow/domain/quantile.hpp>
#include <opencv2/imgproc.hpp>

#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/image/grey_values.hpp"
#include "marrow/toolbox/network/inference.hpp"

namespace marrow::network {
namespace {

constexpr double kMostPixels = 64e6;

/// The width of a pixel of the view at the depth of the bone.
double pixel_at_bone_mm(const View& view, double object_distance_mm) {
  const Camera& camera = view.camera;
  const double depth = object_distance_mm > 0 ? object_distance_mm : camera.camera_from_world.translation_mm.z();
  if (depth <= 0)
    throw Error("view '" + view.name +
                "': the world's origin lies behind the source, so the size of a pixel at the bone is not known; give "
                "object_distance_mm");
  return depth / (0.5 * (camera.intrinsics(0, 0) + camera.intrinsics(1, 1)));
}

/// The size of the image in the network's pixels.
cv::Size size_for(const View& view, const Input& input, double object_distance_mm) {
  const double step = input.pixel_px > 0 ? input.pixel_px : input.pixel_mm / pixel_at_bone_mm(view, object_distance_mm);
  const double columns = std::max(1.0, std::round(view.image.width() / step)),
               rows = std::max(1.0, std::round(view.image.height() / step));
  if (!(columns * rows <= kMostPixels))
    throw Error(
        formatted("view '{}': {} x {} pixels would be {:.0f} x {:.0f} for the network, which is too many; is "
                  "the size of its pixels right?",
                  view.name, view.image.width(), view.image.height(), columns, rows));
  return {int(columns), int(rows)};
}

cv::Mat resized(const cv::Mat& image, const cv::Size& size) {
  cv::Mat result;
  const bool is_smaller = size.width < image.cols || size.height < image.rows;
  cv::resize(image, result, size, 0, 0, is_smaller ? cv::INTER_AREA : cv::INTER_LINEAR);
  return result;
}

cv::Mat values_of(const View& view, const Description& description) {
  const cv::Mat& pixels = view.image.pixels;
  if (pixels.empty()) throw Error("view '" + view.name + "' has no image");
  if (pixels.type() == CV_32F && !cv::checkRange(pixels))
    throw Error("view '" + view.name + "': the image holds pixels that are not finite (NaN or infinity)");
  if (description.input.values == Values::line_integrals) return image::line_integrals(pixels);
  cv::Mat grey;
  pixels.convertTo(grey, CV_32F, -1);  // bone is dark in grey values
  return grey;
}

/// The counted values, for quantiles.
std::vector<float> counted_values(const cv::Mat& values, const cv::Mat& counts) {
  std::vector<float> all;
  all.reserve(values.total());
  for (int v = 0; v < values.rows; ++v)
    for (int u = 0; u < values.cols; ++u)
      if (counts.empty() || counts.at<uchar>(v, u)) all.push_back(values.at<float>(v, u));
  return all;
}

}  // namespace

cv::Mat normalised(const cv::Mat& values, const cv::Mat& counts, const Input& input) {
  const cv::Mat signed_values = input.bone_is_bright ? values : cv::Mat(-values);
  double low = input.normalisation.low, high = input.normalisation.high;
  if (input.normalisation.method != Normalisation::Method::fixed) {
    std::vector<float> all = counted_values(signed_values, counts);
    if (all.empty()) throw Error("no pixel counts for the network: the view's mask leaves out all of them");
    if (input.normalisation.method == Normalisation::Method::percentiles) {
      low = quantile_in_place(all, low / 100);
      high = quantile_in_place(all, high / 100);
    } else {
      double sum = 0, squares = 0;
      for (const float value : all) sum += value;
      low = sum / double(all.size());
      for (const float value : all) squares += (value - low) * (value - low);
      high = low + std::sqrt(squares / double(all.size()));
    }
  }
  cv::Mat result;
  const double scale = high > low ? 1 / (high - low) : 0;
  signed_values.convertTo(result, CV_32F, scale, -scale * low);
  return result;
}

ViewMaps raw_maps_of_view(const Network& network, const Output& output, const View& view, double object_distance_mm,
                          const Context& context) {
  check_view(view);
  const Description& description = network.description();
  const cv::Size size = size_for(view, description.input, object_distance_mm);
  const cv::Mat values = resized(values_of(view, description), size);
  cv::Mat counts;
  if (!view.mask.empty()) cv::resize(view.mask, counts, size, 0, 0, cv::INTER_NEAREST);
  ViewMaps maps;
  maps.channels = network.maps({normalised(values, counts, description.input)}, output, context);
  maps.step_u_px = double(view.image.width()) / size.width * output.stride_px;
  maps.step_v_px = double(view.image.height()) / size.height * output.stride_px;
  return maps;
}

std::vector<cv::Mat> maps_of_view(const Network& network, const Output& output, const View& view,
                                  double object_distance_mm, const Context& context) {
  const ViewMaps maps = raw_maps_of_view(network, output, view, object_distance_mm, context);
  std::vector<cv::Mat> channels;
  for (const cv::Mat& raw : maps.channels) {
    // A map's last pixel may reach beyond the image, so the places are computed from its steps.
    cv::Mat map;
    const cv::Matx23d view_from_map(1 / maps.step_u_px, 0, 0.5 / maps.step_u_px - 0.5, 0, 1 / maps.step_v_px,
                                    0.5 / maps.step_v_px - 0.5);
    cv::warpAffine(raw, map, view_from_map, view.image.pixels.size(), cv::INTER_LINEAR | cv::WARP_INVERSE_MAP,
                   cv::BORDER_REPLICATE);
    channels.push_back(map);
  }
  return channels;
}

}  // namespace marrow::network
