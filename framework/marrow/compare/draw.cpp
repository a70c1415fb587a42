// SPDX-License-Identifier: Apache-2.0
#include "draw.hpp"

#include <algorithm>
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

}  // namespace marrow::compare
