// SPDX-License-Identifier: Apache-2.0
#pragma once
// Compares two values of any type with `fields`, number by number.
#include <cmath>
#include <opencv2/core.hpp>

#include "marrow/base/archive.hpp"

namespace marrow::cli {

struct NumberDifference {
  std::size_t count = 0;  ///< number of numbers, as far as both values have the same shape
  std::size_t differ = 0;
  double largest = 0;      ///< largest difference; infinite if a number is finite in one value only
  std::size_t texts = 0;   ///< number of texts that differ
  bool same_shape = true;  ///< lists, images and optional values have the same sizes

  template <class T>
  void add(const T& a, const T& b) {
    if constexpr (detail::Plain<T>) {
      add_number(double(a), double(b));
    } else if constexpr (detail::HasFields<T>) {
      detail::for_each_field<T>([&](auto member) { add(a.*member, b.*member); });
    } else {
      add_container(a, b);
    }
  }

 private:
  void add_number(double a, double b) {
    ++count;
    if (a == b || (std::isnan(a) && std::isnan(b))) return;
    ++differ;
    const double difference = std::abs(a - b);
    largest = std::max(largest, std::isnan(difference) ? HUGE_VAL : difference);
  }
  void add_container(const std::string& a, const std::string& b) { texts += a != b; }
  void add_container(const cv::Mat& a, const cv::Mat& b) {
    if (a.size() != b.size() || a.type() != b.type()) {
      same_shape = false;
      return;
    }
    cv::Mat wide_a, wide_b;
    a.reshape(1).convertTo(wide_a, CV_64F);
    b.reshape(1).convertTo(wide_b, CV_64F);
    for (int row = 0; row < wide_a.rows; ++row)
      for (int column = 0; column < wide_a.cols; ++column)
        add_number(wide_a.at<double>(row, column), wide_b.at<double>(row, column));
  }
  template <class S, int R, int C>
  void add_container(const Eigen::Matrix<S, R, C>& a, const Eigen::Matrix<S, R, C>& b) {
    same_shape = same_shape && a.rows() == b.rows() && a.cols() == b.cols();
    for (Eigen::Index i = 0; i < a.size() && same_shape; ++i) add_number(double(a.data()[i]), double(b.data()[i]));
  }
  template <class T>
  void add_container(const std::optional<T>& a, const std::optional<T>& b) {
    same_shape = same_shape && a.has_value() == b.has_value();
    if (a && b) add(*a, *b);
  }
  template <class K, class V>
  void add_container(const std::map<K, V>& a, const std::map<K, V>& b) {
    same_shape = same_shape && a.size() == b.size();
    for (const auto& [key, value] : a)
      if (const auto other = b.find(key); other != b.end())
        add(value, other->second);
      else
        same_shape = false;
  }
  template <class T>
  void add_container(const List<T>& a, const List<T>& b) {
    same_shape = same_shape && a.names() == b.names();
    for (std::size_t i = 0; i < a.size() && same_shape; ++i) add(a[i], b[i]);
  }
  /// std::vector and std::array.
  template <class Items>
  void add_container(const Items& a, const Items& b) {
    same_shape = same_shape && a.size() == b.size();
    for (std::size_t i = 0; i < a.size() && same_shape; ++i) add(a[i], b[i]);
  }
};

}  // namespace marrow::cli
