// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>

namespace marrow::phantom {

/// Random numbers that depend on (seed, stream) alone: one stream for each pixel or voxel gives the same noise
/// whichever thread draws it. SplitMix64 (Steele, Lea, Flood, OOPSLA 2014), started from a mix of both.
class Random {
 public:
  using result_type = std::uint64_t;
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mix(seed + 0x9e3779b97f4a7c15u) ^ mix(~stream)) {}
  static constexpr result_type min() { return 0; }
  static constexpr result_type max() { return ~result_type(0); }
  result_type operator()() { return mix(state_ += 0x9e3779b97f4a7c15u); }

  /// In (0, 1).
  double uniform() { return (double((*this)() >> 11) + 0.5) * 0x1.0p-53; }
  /// Standard normal (Box and Muller, Ann. Math. Stat. 1958, Eq 1).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(uniform()));
    return radius * std::cos(6.283185307179586 * uniform());
  }

 private:
  static std::uint64_t mix(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

}  // namespace marrow::phantom
