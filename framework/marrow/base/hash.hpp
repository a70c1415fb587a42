// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <string>

#include "marrow/base/archive.hpp"

namespace MARROW_EXPORT marrow {

/// 128-bit digest. It serves as the key of a value, the content hash of a value and the identity of a library.
struct Digest {
  std::uint64_t low = 0, high = 0;
  auto operator<=>(const Digest&) const = default;
  std::string hex() const;
  using fields = Fields<&Digest::low, &Digest::high>;
};

/// Streaming 128-bit hash (XXH3) of everything that is added. So the hash of a value is the hash of its packed bytes.
class Hasher : public Archive {
 public:
  Hasher();
  ~Hasher() override;
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;

  void bytes(const void* data, std::size_t size) override;
  Digest digest() const;

  using Archive::add;
  void add(const Digest& digest) {
    add(digest.low);
    add(digest.high);
  }

 private:
  void* state_;
};

/// The digest that a text of 32 hexadecimal digits stands for; nothing for any other text.
std::optional<Digest> digest_of_hex(const std::string& text);

/// Hash of one contiguous block of bytes.
Digest hash_of_bytes(const void* data, std::size_t size);

/// Hash of some values, one after the other.
template <class... T>
Digest hash_of(const T&... values) {
  Hasher hasher;
  (hasher.add(values), ...);
  return hasher.digest();
}

}  // namespace marrow
