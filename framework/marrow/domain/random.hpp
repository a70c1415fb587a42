// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "marrow/base/export.hpp"

namespace MARROW_EXPORT marrow {

/// Random numbers that are the same on every machine; the distributions of the C++ standard do not guarantee that. The
/// generator is SplitMix64 (Steele, Lea and Flood, OOPSLA 2014, Fig 17).
class Random {
 public:
  using result_type = std::uint64_t;
  explicit Random(std::uint64_t seed) : state_(seed) {}
  /// Numbers that depend only on (seed, stream). With one stream per pixel or voxel, the noise does not depend on which
  /// thread draws it.
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mix(seed + kStep) ^ mix(~stream)) {}

  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type(0); }
  result_type operator()() { return mix(state_ += kStep); }

  /// Uniform in [0, 1).
  double uniform() { return double((*this)() >> 11) * 0x1p-53; }
  /// Uniform in (0, 1): never 0, so its logarithm is finite.
  double uniform_above_0() { return (double((*this)() >> 11) + 0.5) * 0x1p-53; }
  /// Standard normal (Box and Muller, Ann. Math. Stat. 1958, Eq 1).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform_above_0()));
    return radius * std::cos(6.283185307179586 * uniform_above_0());
  }
  /// Uniform in 0 ... count - 1. The upper 32 bits are scaled, so the probabilities have a relative error below count /
  /// 2^32.
  std::size_t index(std::size_t count) { return static_cast<std::size_t>((((*this)() >> 32) * count) >> 32); }

 private:
  static constexpr std::uint64_t kStep = 0x9e3779b97f4a7c15u;
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace marrow
