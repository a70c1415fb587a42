// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <marrow/plugin.hpp>

#include "marrow/toolbox/files/atomic_write.hpp"
#include "marrow/write/picture_out.hpp"

namespace {

void write_png(const std::string& path, const cv::Mat& pixels) {
  marrow::files::write_atomically(path, [&](const auto& temporary) { marrow::write::write_pixels(temporary, pixels); });
}

/// 8 and 16 bits are kept as they are. PNG has no float, so a float image is scaled: its least value becomes 0, its
/// greatest 65535.
void image(const marrow::Image& image, const std::string& path) {
  if (image.pixels.depth() != CV_32F) return write_png(path, image.pixels);
  marrow::write::check_finite_pixels(image.pixels, path);
  double least = 0, greatest = 0;
  cv::minMaxLoc(image.pixels, &least, &greatest);
  const double scale = greatest > least ? 65535 / (greatest - least) : 0;
  cv::Mat scaled;
  image.pixels.convertTo(scaled, CV_16U, scale, -least * scale);
  write_png(path, scaled);
}

void picture(const marrow::Picture& picture, const std::string& path) { write_png(path, picture.pixels); }

void edge_map(const marrow::EdgeMap& edges, const std::string& path) {
  cv::Mat pixels = cv::Mat::zeros(edges.height_px, edges.width_px, CV_8U);
  for (const marrow::EdgePixel& edge : edges.pixels) {
    if (!std::isfinite(edge.u_px) || !std::isfinite(edge.v_px))
      throw marrow::Error(path + ": cannot be written, because the place of an edge is not a finite number");
    const int u = int(std::lround(edge.u_px)), v = int(std::lround(edge.v_px));
    if (u >= 0 && v >= 0 && u < edges.width_px && v < edges.height_px) pixels.at<std::uint8_t>(v, u) = 255;
  }
  write_png(path, pixels);
}

}  // namespace

MARROW_PLUGIN(plugin) {
  plugin.writer<marrow::Image>(".png", image, "PNG; 8 or 16 bits are kept, float is scaled to 16 bits");
  plugin.writer<marrow::Picture>(".png", picture, "PNG in colour");
  plugin.writer<marrow::EdgeMap>(".png", edge_map, "PNG, edges white on black");
}
