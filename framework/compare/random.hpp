// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace marrow::compare {

/// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014): the same numbers on any machine, which the standard's distributions do
/// not promise.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  /// In [0, 1).
  double uniform() { return double(bits() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

}  // namespace marrow::compare
