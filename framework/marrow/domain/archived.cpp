// SPDX-License-Identifier: Apache-2.0
#include "marrow/domain/archived.hpp"

namespace marrow::detail {

void add_image(Archive& archive, const cv::Mat& image) {
  archive.add(std::int32_t(image.rows));
  archive.add(std::int32_t(image.cols));
  archive.add(std::int32_t(image.type()));
  for (int row = 0; row < image.rows; ++row) archive.bytes(image.ptr(row), image.elemSize() * std::size_t(image.cols));
}

void read_image(Unpacker& unpacker, cv::Mat& image) {
  const auto rows = unpacker.get<std::int32_t>(), cols = unpacker.get<std::int32_t>();
  const auto type = unpacker.get<std::int32_t>();
  const std::size_t pixel = std::size_t(CV_ELEM_SIZE(type));
  if (rows < 0 || cols < 0 || type < 0 || type > CV_MAT_TYPE_MASK ||
      (rows && std::size_t(cols) > unpacker.remaining() / pixel / std::size_t(rows)))
    throw Error("the packed value holds an image of impossible size");
  image = rows && cols ? cv::Mat(rows, cols, type) : cv::Mat();
  unpacker.bytes(image.data, pixel * std::size_t(rows) * std::size_t(cols));
}

}  // namespace marrow::detail
