// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values as bytes: for their hash, for the store and for other processes.
#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "marrow/base/error.hpp"
#include "marrow/base/fields.hpp"
#include "marrow/base/large_memory.hpp"

namespace MARROW_EXPORT marrow {
namespace detail {

/// Types whose arrays have no padding. Long lists of them are read and written in one piece.
template <class T>
struct Bulk : std::bool_constant<std::is_arithmetic_v<T> && !std::is_same_v<T, bool>> {};
template <class T, std::size_t N>
struct Bulk<std::array<T, N>> : Bulk<T> {};

/// An enum can be archived only if there is a function `bool is_valid(E)` for it, because a damaged or forged value may
/// be any number.
template <class T>
concept CheckedEnum = std::is_enum_v<T> && requires(T value) {
  { is_valid(value) } -> std::same_as<bool>;
};
template <class T>
concept Plain = std::is_arithmetic_v<T> || CheckedEnum<T>;

}  // namespace detail

/// How a type that has no `fields` is archived. A specialisation has two functions:
///   static void add(Archive& archive, const T& value);
///   static void read(Unpacker& unpacker, T& value);
/// domain/archived.hpp has those of matrices, images and lists.
template <class T>
struct Archived {};

/// Receives values as bytes. Values may be arithmetic types, enums with is_valid(), strings, containers of these,
/// structs with `fields`, and types that Archived knows. Lengths are included, so that the ends of neighbouring values
/// are known. Unpacker reads the values back.
class Archive {
 public:
  virtual ~Archive() = default;
  virtual void bytes(const void* data, std::size_t size) = 0;

  template <class T>
  void add(const T& value) {
    if constexpr (detail::Plain<T>) {
      bytes(&value, sizeof value);
    } else if constexpr (detail::HasFields<T>) {
      detail::for_each_field<T>([&](auto member) { add(value.*member); });
    } else {
      add_container(value);
    }
  }
  void add(const std::string& text) { add(std::string_view(text)); }
  void add(std::string_view text) {
    add(std::uint64_t(text.size()));
    bytes(text.data(), text.size());
  }

 private:
  template <class T>
  void add_container(const T& value) {
    Archived<T>::add(*this, value);
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
  template <class K, class V>
  void add_container(const std::map<K, V>& items) {
    add(std::uint64_t(items.size()));
    for (const auto& [key, item] : items) {
      add(key);
      add(item);
    }
  }
};

/// An archive that keeps the bytes in memory.
class Packer : public Archive {
 public:
  void bytes(const void* data, std::size_t size) override { packed.append(static_cast<const char*>(data), size); }
  std::string packed;
};

/// Counts the bytes, and passes them on if there is somewhere to.
class ByteCounter : public Archive {
 public:
  explicit ByteCounter(Archive* out = nullptr) : out_(out) {}
  void bytes(const void* data, std::size_t size) override {
    if (out_) out_->bytes(data, size);
    count += size;
  }
  std::uint64_t count = 0;

 private:
  Archive* out_;
};

/// Reads the values that were added to an Archive, in the same order and with the same types. Throws Error if the bytes
/// end too early or are not values of these types. It may read any bytes: it does not reserve memory for a length that
/// the remaining bytes cannot hold.
class Unpacker {
 public:
  explicit Unpacker(std::string_view packed) : remaining_(packed.size()), next_(packed.data()) {}
  virtual ~Unpacker() = default;
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  template <class T>
  T get() {
    T value{};
    read(value);
    return value;
  }
  template <class T>
  void read(T& value) {
    if constexpr (std::is_same_v<T, bool>) {
      value = truth(get<std::uint8_t>());
    } else if constexpr (std::is_enum_v<T>) {
      value = T(get<std::underlying_type_t<T>>());
      if (!is_valid(value)) throw Error("the packed value holds an unknown choice");
    } else if constexpr (detail::Plain<T>) {
      bytes(&value, sizeof value);
    } else if constexpr (detail::HasFields<T>) {
      detail::for_each_field<T>([&](auto member) { read(value.*member); });
    } else {
      read_container(value);
    }
  }
  std::size_t remaining() const { return remaining_; }
  /// Copies the next `size` bytes.
  void bytes(void* data, std::size_t size) {
    if (size > remaining_) throw Error("the packed value ends too early");
    if (size) take(data, size);
    remaining_ -= size;
  }

 protected:
  /// For a derived class whose take() gets the bytes from elsewhere.
  explicit Unpacker(std::size_t size) : remaining_(size) {}
  /// Copies the next `size` bytes. `size` is never larger than remaining().
  virtual void take(void* data, std::size_t size) {
    std::memcpy(data, next_, size);
    next_ += size;
  }

 private:
  static bool truth(std::uint8_t byte) {
    if (byte > 1) throw Error("the packed value holds a truth value that is neither 0 nor 1");
    return byte == 1;
  }
  /// Reads a length. Throws Error if the remaining bytes cannot hold that many items: a damaged length must not ask for
  /// all the memory.
  std::size_t length(std::size_t item_size) {
    const auto count = get<std::uint64_t>();
    if (count > remaining_ / item_size) throw Error("the packed value ends too early");
    return std::size_t(count);
  }
  void read_container(std::string& text) {
    text.resize(length(1));
    bytes(text.data(), text.size());
  }
  template <class T>
  void read_container(T& value) {
    Archived<T>::read(*this, value);
  }
  template <class T, std::size_t N>
  void read_container(std::array<T, N>& items) {
    for (T& item : items) read(item);
  }
  template <class T>
  void read_container(std::vector<T>& items) {
    if constexpr (detail::Bulk<T>::value) {
      const std::size_t count = length(sizeof(T));
      items.clear();
      resize_large(items, count);
      bytes(items.data(), count * sizeof(T));
    } else {
      // An item may take fewer bytes here than in memory. So the vector reserves little and grows with the items that
      // are really there.
      const std::size_t count = length(1);
      items.clear();
      items.reserve(std::min(count, remaining_ / sizeof(T)));
      for (std::size_t i = 0; i < count; ++i) items.push_back(get<T>());
    }
  }
  template <class T>
  void read_container(std::optional<T>& item) {
    item.reset();
    if (get<bool>()) item = get<T>();
  }
  template <class K, class V>
  void read_container(std::map<K, V>& items) {
    items.clear();
    for (std::size_t count = length(1); count > 0; --count) {
      K key = get<K>();
      items.emplace(std::move(key), get<V>());
    }
  }

  std::size_t remaining_;
  const char* next_ = nullptr;
};

}  // namespace marrow
