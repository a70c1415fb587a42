// SPDX-License-Identifier: Apache-2.0
#pragma once
// How matrices, images and lists are hashed and stored.
#include <Eigen/Core>
#include <limits>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "marrow/base/archive.hpp"
#include "marrow/domain/list.hpp"

namespace MARROW_EXPORT marrow {

template <class S, int R, int C>
struct detail::Bulk<Eigen::Matrix<S, R, C>> : std::bool_constant<(R > 0 && C > 0 && Bulk<S>::value)> {};

template <class S, int R, int C>
struct Archived<Eigen::Matrix<S, R, C>> {
  static void add(Archive& archive, const Eigen::Matrix<S, R, C>& matrix) {
    archive.add(std::int64_t(matrix.rows()));
    archive.add(std::int64_t(matrix.cols()));
    archive.bytes(matrix.data(), sizeof(S) * std::size_t(matrix.size()));
  }
  static void read(Unpacker& unpacker, Eigen::Matrix<S, R, C>& matrix) {
    static_assert(detail::Bulk<S>::value, "a matrix of numbers can be read back");
    constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
    const auto rows = unpacker.get<std::int64_t>(), cols = unpacker.get<std::int64_t>();
    if (rows < 0 || cols < 0 || rows > kMost || cols > kMost || (R > 0 && rows != R) || (C > 0 && cols != C) ||
        (cols && std::size_t(rows) > unpacker.remaining() / sizeof(S) / std::size_t(cols)))
      throw Error("the packed value holds a matrix of another size");
    matrix.resize(rows, cols);
    unpacker.bytes(matrix.data(), sizeof(S) * std::size_t(matrix.size()));
  }
};

namespace detail {
void add_image(Archive& archive, const cv::Mat& image);
void read_image(Unpacker& unpacker, cv::Mat& image);
}  // namespace detail

template <>
struct Archived<cv::Mat> {
  static void add(Archive& archive, const cv::Mat& image) { detail::add_image(archive, image); }
  static void read(Unpacker& unpacker, cv::Mat& image) { detail::read_image(unpacker, image); }
};

template <class T>
struct Archived<List<T>> {
  static void add(Archive& archive, const List<T>& items) {
    archive.add(items.names());
    for (const T& item : items) archive.add(item);
  }
  static void read(Unpacker& unpacker, List<T>& items) {
    items = {};
    for (const std::string& name : unpacker.get<std::vector<std::string>>()) items.add(name, unpacker.get<T>());
  }
};

}  // namespace marrow
