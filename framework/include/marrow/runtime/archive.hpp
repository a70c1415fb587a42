// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "marrow/domain/error.hpp"
#include "marrow/domain/list.hpp"

namespace marrow {
namespace detail {

/// Types whose arrays hold no padding, so that long lists of them are read and written in one go.
template <class T>
struct Bulk : std::bool_constant<std::is_arithmetic_v<T> && !std::is_same_v<T, bool>> {};
template <class S, int R, int C>
struct Bulk<Eigen::Matrix<S, R, C>> : std::bool_constant<(R > 0 && C > 0)> {};
template <class T, std::size_t N>
struct Bulk<std::array<T, N>> : Bulk<T> {};

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;
template <class T>
concept HasFields = requires { T::fields(); };

}  // namespace detail

/// Takes the bytes of values: of arithmetic types, enums, strings, containers of such, Eigen matrices, cv::Mat and structs
/// with fields(). Lengths are part of it, so that neighbours cannot run together. Unpacker reads the same back.
class Archive {
 public:
  virtual ~Archive() = default;
  virtual void bytes(const void* data, std::size_t size) = 0;

  template <class T>
  void add(const T& value) {
    if constexpr (detail::Plain<T>) {
      bytes(&value, sizeof value);
    } else if constexpr (detail::HasFields<T>) {
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
    if constexpr (detail::Bulk<T>::value) {
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
};

/// Keeps the bytes.
class Packer : public Archive {
 public:
  void bytes(const void* data, std::size_t size) override { packed.append(static_cast<const char*>(data), size); }
  std::string packed;
};

/// Reads what an Archive took, in the same order and of the same types. Throws Error where the bytes end too early.
class Unpacker {
 public:
  explicit Unpacker(std::string_view packed) : rest_(packed) {}

  template <class T>
  T get() {
    T value{};
    read(value);
    return value;
  }
  template <class T>
  void read(T& value) {
    if constexpr (detail::Plain<T>) {
      bytes(&value, sizeof value);
    } else if constexpr (detail::HasFields<T>) {
      std::apply([&](auto... member) { (read(value.*member), ...); }, T::fields());
    } else {
      read_container(value);
    }
  }
  std::size_t remaining() const { return rest_.size(); }

 private:
  void bytes(void* data, std::size_t size) {
    if (size > rest_.size()) throw Error("the packed value ends too early");
    if (size) std::memcpy(data, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  /// A length that the remaining bytes can hold; a damaged one must not ask for all the memory.
  std::size_t length(std::size_t item_size) {
    const auto count = get<std::uint64_t>();
    if (count > rest_.size() / item_size) throw Error("the packed value ends too early");
    return std::size_t(count);
  }
  void read_container(std::string& text) {
    text.resize(length(1));
    bytes(text.data(), text.size());
  }
  void read_container(cv::Mat& image);
  template <class S, int R, int C>
  void read_container(Eigen::Matrix<S, R, C>& matrix) {
    const auto rows = get<std::int64_t>(), cols = get<std::int64_t>();
    if (rows < 0 || cols < 0 || (cols && std::size_t(rows) > rest_.size() / sizeof(S) / std::size_t(cols)) || (R > 0 && rows != R) ||
        (C > 0 && cols != C))
      throw Error("the packed value holds a matrix of another size");
    matrix.resize(rows, cols);
    bytes(matrix.data(), sizeof(S) * std::size_t(matrix.size()));
  }
  template <class T, std::size_t N>
  void read_container(std::array<T, N>& items) {
    for (T& item : items) read(item);
  }
  template <class T>
  void read_container(std::vector<T>& items) {
    if constexpr (detail::Bulk<T>::value) {
      items.resize(length(sizeof(T)));
      bytes(items.data(), items.size() * sizeof(T));
    } else {
      items.resize(length(1));
      for (T& item : items) read(item);
    }
  }
  template <class T>
  void read_container(std::optional<T>& item) {
    item.reset();
    if (get<bool>()) item = get<T>();
  }
  template <class T>
  void read_container(List<T>& items) {
    items = {};
    for (const std::string& name : get<std::vector<std::string>>()) items.add(name, get<T>());
  }
  template <class K, class V>
  void read_container(std::map<K, V>& items) {
    items.clear();
    for (std::size_t count = length(1); count > 0; --count) {
      K key = get<K>();
      items.emplace(std::move(key), get<V>());
    }
  }

  std::string_view rest_;
};

}  // namespace marrow
