// SPDX-License-Identifier: Apache-2.0
#include "marrow/write/picture_out.hpp"

#include <algorithm>
#include <cmath>

#include "marrow/base/error.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/toolbox/files/samples_out.hpp"

namespace marrow::write {

void check_finite_pixels(const cv::Mat& pixels, const std::filesystem::path& path) {
  if (pixels.type() != CV_32FC1) return;
  for (int v = 0; v < pixels.rows; ++v)
    for (int u = 0; u < pixels.cols; ++u)
      if (!std::isfinite(pixels.at<float>(v, u)))
        throw Error(
            formatted("{}: cannot be written, because pixel ({}, {}) is not a finite number; replace NaN and "
                      "infinities where the image is made",
                      path.string(), u, v));
}

void write_pixels(const std::filesystem::path& path, const cv::Mat& pixels) {
  if (pixels.empty()) throw Error(path.string() + ": the image is empty, there is nothing to write");
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  check_finite_pixels(whole, path);
  const int channels = whole.channels();
  if (whole.depth() == CV_8U && (channels == 1 || channels == 3))
    return files::write_png(path, whole.cols, whole.rows, channels, files::Sample::u8, whole.data);
  if (whole.depth() == CV_16U && (channels == 1 || channels == 3))
    return files::write_png(path, whole.cols, whole.rows, channels, files::Sample::u16, whole.data);
  if (whole.type() == CV_32FC1) return files::write_float_tiff(path, whole.cols, whole.rows, whole.ptr<float>());
  throw Error(path.string() + ": expected pixels of one or three channels of 8 or 16 bits, or one of float");
}

void write_grid(const std::filesystem::path& path, const Grid& grid, const std::vector<float>& values) {
  if (grid.size[0] <= 0 || grid.size[1] <= 0 || grid.size[2] <= 0) throw Error(path.string() + ": the volume is empty");
  if (values.size() != grid.count())
    throw Error(
        formatted("{}: {} samples expected from the grid's size, got {}", path.string(), grid.count(), values.size()));
  const auto bad = std::find_if(values.begin(), values.end(), [](float value) { return !std::isfinite(value); });
  if (bad != values.end()) {
    const std::size_t at = std::size_t(bad - values.begin()), row = std::size_t(grid.size[0]),
                      slice = row * std::size_t(grid.size[1]);
    throw Error(
        formatted("{}: cannot be written, because voxel ({}, {}, {}) is not a finite number; replace NaN and "
                  "infinities where the volume is made",
                  path.string(), at % row, at % slice / row, at / slice));
  }
  files::GridOut out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.size[k] = grid.size[k];
    out.spacing_mm[k] = grid.spacing_mm[Eigen::Index(k)];
    out.origin_mm[k] = grid.origin_mm[Eigen::Index(k)];
    for (std::size_t row = 0; row < 3; ++row) out.axes[k][row] = grid.direction(Eigen::Index(row), Eigen::Index(k));
  }
  files::write_mha(path, out, values.data());
}

}  // namespace marrow::write
