// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdint>

namespace marrow::compare {

/// SplitMix64 (Steele, Lea and Flood 2014, OOPSLA, Fig 17): the same numbers on any machine, which the standard's
/// distributions do not promise.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t bits = state_;
    bits = (bits ^ (bits >> 30)) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ (bits >> 27)) * 0x94d049bb133111ebu;
    return bits ^ (bits >> 31);
  }
  /// Uniform in [0, 1).
  double uniform() { return double(bits() >> 11) * 0x1p-53; }
  /// Uniform in 0 ... count - 1. The upper 32 bits are scaled: the chances differ by less than count / 2^32 of
  /// themselves.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>(((bits() >> 32) * count) >> 32); }

 private:
  std::uint64_t state_;
};

}  // namespace marrow::compare
