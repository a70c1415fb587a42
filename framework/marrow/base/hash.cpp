// SPDX-License-Identifier: Apache-2.0
#include "marrow/base/hash.hpp"

#include <xxhash.h>

#include <charconv>
#include <new>

#include "marrow/base/number_text.hpp"

namespace marrow {

std::string Digest::hex() const { return formatted("{:016x}{:016x}", high, low); }

std::optional<Digest> digest_of_hex(const std::string& text) {
  Digest digest;
  const char* begin = text.data();
  if (text.size() != 32) return std::nullopt;
  const auto high = std::from_chars(begin, begin + 16, digest.high, 16),
             low = std::from_chars(begin + 16, begin + 32, digest.low, 16);
  if (high.ptr != begin + 16 || low.ptr != begin + 32) return std::nullopt;
  return digest;
}

Hasher::Hasher() : state_(XXH3_createState()) {
  if (!state_) throw std::bad_alloc();
  XXH3_128bits_reset(static_cast<XXH3_state_t*>(state_));
}
Hasher::~Hasher() { XXH3_freeState(static_cast<XXH3_state_t*>(state_)); }

void Hasher::bytes(const void* data, std::size_t size) {
  if (size) XXH3_128bits_update(static_cast<XXH3_state_t*>(state_), data, size);
}

Digest Hasher::digest() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(static_cast<XXH3_state_t*>(state_));
  return {hash.low64, hash.high64};
}

Digest hash_of_bytes(const void* data, std::size_t size) {
  const XXH128_hash_t hash = XXH3_128bits(data, size);
  return {hash.low64, hash.high64};
}

}  // namespace marrow
