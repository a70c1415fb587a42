// SPDX-License-Identifier: Apache-2.0
#include "marrow/toolbox/files/picture_out.hpp"

#include "marrow/domain/error.hpp"
#include "marrow/toolbox/files/samples_out.hpp"

namespace marrow::files {

void write_pixels(const std::filesystem::path& path, const cv::Mat& pixels) {
  if (pixels.empty()) throw Error(path.string() + ": the image is empty, there is nothing to write");
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  const int channels = whole.channels();
  if (whole.depth() == CV_8U && (channels == 1 || channels == 3))
    return write_png(path, whole.cols, whole.rows, channels, Sample::u8, whole.data);
  if (whole.depth() == CV_16U && (channels == 1 || channels == 3))
    return write_png(path, whole.cols, whole.rows, channels, Sample::u16, whole.data);
  if (whole.type() == CV_32FC1) return write_float_tiff(path, whole.cols, whole.rows, whole.ptr<float>());
  throw Error(path.string() + ": expected pixels of one or three channels of 8 or 16 bits, or one of float");
}

void write_grid(const std::filesystem::path& path, const Grid& grid, const std::vector<float>& values) {
  if (grid.size[0] <= 0 || grid.size[1] <= 0 || grid.size[2] <= 0) throw Error(path.string() + ": the volume is empty");
  if (values.size() != grid.count())
    throw Error(path.string() + ": " + std::to_string(grid.count()) + " samples expected from the grid's size, got " +
                std::to_string(values.size()));
  GridOut out;
  for (std::size_t k = 0; k < 3; ++k) {
    out.size[k] = grid.size[k];
    out.spacing_mm[k] = grid.spacing_mm[Eigen::Index(k)];
    out.origin_mm[k] = grid.origin_mm[Eigen::Index(k)];
    for (std::size_t row = 0; row < 3; ++row) out.axes[k][row] = grid.direction(Eigen::Index(row), Eigen::Index(k));
  }
  write_mha(path, out, values.data());
}

}  // namespace marrow::files
