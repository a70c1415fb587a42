// SPDX-License-Identifier: Apache-2.0
#include "marrow/runtime/archive.hpp"

namespace marrow {

void Archive::add(const cv::Mat& image) {
  add(std::int32_t(image.rows));
  add(std::int32_t(image.cols));
  add(std::int32_t(image.type()));
  for (int row = 0; row < image.rows; ++row) bytes(image.ptr(row), image.elemSize() * std::size_t(image.cols));
}

void Unpacker::read_container(cv::Mat& image) {
  const auto rows = get<std::int32_t>(), cols = get<std::int32_t>(), type = get<std::int32_t>();
  const std::size_t pixel = std::size_t(CV_ELEM_SIZE(type));
  if (rows < 0 || cols < 0 || type < 0 || type > CV_MAT_TYPE_MASK ||
      (rows && std::size_t(cols) > remaining_ / pixel / std::size_t(rows)))
    throw Error("the packed value holds an image of impossible size");
  image = rows && cols ? cv::Mat(rows, cols, type) : cv::Mat();
  bytes(image.data, pixel * std::size_t(rows) * std::size_t(cols));
}

}  // namespace marrow
