// SPDX-License-Identifier: Apache-2.0
#include "sobol.hpp"

#include <cstdint>

namespace marrow::compare {
namespace {

constexpr std::size_t kBits = 32;

/// A primitive polynomial modulo 2, and the first direction numbers, which are as many as its degree.
struct Polynomial {
  std::size_t degree;
  std::uint32_t inner_coefficients;
  std::array<std::uint32_t, 4> first;
};

/// Of the second and further dimensions.
constexpr std::array<Polynomial, kMostSobolDimensions - 1> kPolynomials{
    {{1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}, {3, 2, {1, 1, 1}}, {4, 1, {1, 1, 3, 3}}}};

/// The direction numbers of a dimension as fractions of 2^32 (Joe and Kuo 2008, Eq 2).
std::array<std::uint32_t, kBits> directions(std::size_t dimension) {
  std::array<std::uint32_t, kBits> v{};
  if (dimension == 0) {
    for (std::size_t k = 0; k < kBits; ++k) v[k] = std::uint32_t(1) << (kBits - 1 - k);
    return v;
  }
  const auto& [degree, inner, first] = kPolynomials[dimension - 1];
  for (std::size_t k = 0; k < kBits; ++k) {
    if (k < degree) {
      v[k] = first[k] << (kBits - 1 - k);
      continue;
    }
    v[k] = v[k - degree] ^ (v[k - degree] >> degree);
    for (std::size_t j = 1; j < degree; ++j)
      if (inner >> (degree - 1 - j) & 1) v[k] ^= v[k - j];
  }
  return v;
}

}  // namespace

std::array<double, kMostSobolDimensions> sobol_point(std::size_t number) {
  std::array<double, kMostSobolDimensions> point{};
  const std::uint32_t gray = std::uint32_t(number) ^ (std::uint32_t(number) >> 1);
  for (std::size_t d = 0; d < kMostSobolDimensions; ++d) {
    const std::array<std::uint32_t, kBits> v = directions(d);
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < kBits; ++k)
      if (gray >> k & 1) bits ^= v[k];
    point[d] = double(bits) * 0x1p-32;
  }
  return point;
}

}  // namespace marrow::compare
