// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "marrow/domain/list.hpp"

namespace marrow {

/// 128-bit digest: the key of a value, the content hash of a value, the identity of a library.
struct Digest {
  std::uint64_t low = 0, high = 0;
  auto operator<=>(const Digest&) const = default;
  std::string hex() const;
};

/// Streaming 128-bit hash (XXH3). add() reads any value whose type is arithmetic, an enum, a string, a container of such, an
/// Eigen matrix, a cv::Mat or a struct with fields(). Lengths are hashed too, so that neighbours cannot run together.
class Hasher {
 public:
  Hasher();
  ~Hasher();
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  void bytes(const void* data, std::size_t size);
  Digest digest() const;

  template <class T>
  void add(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
      bytes(&value, sizeof value);
    } else if constexpr (requires { T::fields(); }) {
      std::apply([&](auto... member) { (add(value.*member), ...); }, T::fields());
    } else {
      add_container(value);
    }
  }
  void add(const std::string& text) { add(std::string_view(text)); }
  void add(std::string_view text) {
    add(std::uint64_t(text.size()));
    bytes(text.data(), text.size());
  }
  void add(const Digest& digest) {
    add(digest.low);
    add(digest.high);
  }
  void add(const cv::Mat& image);

 private:
  template <class S, int R, int C>
  void add_container(const Eigen::Matrix<S, R, C>& matrix) {
    add(std::int64_t(matrix.rows()));
    add(std::int64_t(matrix.cols()));
    bytes(matrix.data(), sizeof(S) * std::size_t(matrix.size()));
  }
  template <class T, std::size_t N>
  void add_container(const std::array<T, N>& items) {
    for (const T& item : items) add(item);
  }
  template <class T>
  void add_container(const std::vector<T>& items) {
    add(std::uint64_t(items.size()));
    // Fixed-size Eigen vectors and arrays of numbers have no padding, so long lists of them are hashed in one go.
    if constexpr (kBulk<T>) {
      bytes(items.data(), items.size() * sizeof(T));
    } else {
      for (const T& item : items) add(item);
    }
  }
  template <class T>
  void add_container(const std::optional<T>& item) {
    add(item.has_value());
    if (item) add(*item);
  }
  template <class T>
  void add_container(const List<T>& items) {
    add(items.names());
    for (const T& item : items) add(item);
  }
  template <class K, class V>
  void add_container(const std::map<K, V>& items) {
    add(std::uint64_t(items.size()));
    for (const auto& [key, item] : items) {
      add(key);
      add(item);
    }
  }

  template <class T>
  struct Bulk : std::bool_constant<std::is_arithmetic_v<T> && !std::is_same_v<T, bool>> {};
  template <class S, int R, int C>
  struct Bulk<Eigen::Matrix<S, R, C>> : std::bool_constant<(R > 0 && C > 0)> {};
  template <class T, std::size_t N>
  struct Bulk<std::array<T, N>> : Bulk<T> {};
  template <class T>
  static constexpr bool kBulk = Bulk<T>::value;

  void* state_;
};

template <class T>
Digest hash_of(const T& value) {
  Hasher hasher;
  hasher.add(value);
  return hasher.digest();
}

}  // namespace marrow
