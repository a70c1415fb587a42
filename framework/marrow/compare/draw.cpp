// SPDX-License-Identifier: Apache-2.0
#include "draw.hpp"

#include <cmath>
#include <numbers>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/random.hpp"

namespace marrow::compare {
namespace {

/// A vector with a direction uniform on the sphere and a length uniform in [0, most].
std::array<double, 3> draw_vector(Random& random, double most) {
  const double z = 2 * random.uniform() - 1, angle = 2 * std::numbers::pi * random.uniform(),
               length = most * random.uniform();
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {length * r * std::cos(angle), length * r * std::sin(angle), length * z};
}

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

std::vector<InputValue> draw_inputs(const std::vector<DrawnInput>& inputs, std::uint64_t seed) {
  Random random(seed);
  std::vector<InputValue> values;
  for (const DrawnInput& input : inputs) {
    const auto& [low, high] = input.range;
    const double value = low + (high - low) * random.uniform();
    values.push_back({input.name, exact_number(input.is_whole ? std::round(value) : value), input.place});
  }
  return values;
}

std::vector<Start> draw_starts(const StartProtocol& protocol) {
  Random random(protocol.seed);
  std::vector<Start> starts;
  for (std::size_t i = 0; i < protocol.count; ++i) {
    Start start{formatted("{}", i), draw_vector(random, protocol.rotation_deg), {}};
    start.translation_mm = draw_vector(random, protocol.translation_mm);
    if (protocol.distance_mm > 0) start.distance_mm = protocol.distance_mm * random.uniform();
    starts.push_back(std::move(start));
  }
  return starts;
}

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
