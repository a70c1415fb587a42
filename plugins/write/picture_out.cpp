// SPDX-License-Identifier: Apache-2.0
#include "picture_out.hpp"

#include "marrow/domain/error.hpp"
#include "samples_out.hpp"

namespace marrow::write {

void write_pixels(const std::filesystem::path& path, const cv::Mat& pixels) {
  if (pixels.empty()) throw Error(path.string() + ": the image is empty, there is nothing to write");
  if (pixels.channels() != 1 && pixels.channels() != 3)
    throw Error(path.string() + ": the image has " + std::to_string(pixels.channels()) + " channels; expected 1 or 3");
  const cv::Mat whole = pixels.isContinuous() ? pixels : pixels.clone();
  switch (whole.depth()) {
    case CV_8U: return write_pixels(path, whole.cols, whole.rows, whole.channels(), Sample::u8, whole.data);
    case CV_16U: return write_pixels(path, whole.cols, whole.rows, whole.channels(), Sample::u16, whole.data);
    case CV_32F: return write_pixels(path, whole.cols, whole.rows, whole.channels(), Sample::f32, whole.data);
    default: throw Error(path.string() + ": expected pixels of 8 or 16 bits or float");
  }
}

void write_grid(const std::filesystem::path& path, const Grid& grid, const std::vector<float>& values) {
  if (grid.count() == 0 || values.size() != grid.count())
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

}  // namespace marrow::write
