// SPDX-License-Identifier: Apache-2.0
#pragma once
// The random draws of an experiment. They depend only on its seeds and are the same on every machine.
#include <array>
#include <cstddef>
#include <vector>

#include "marrow/compare/experiment.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {
namespace compare {

/// The values of the drawn inputs, in their order.
std::vector<InputValue> draw_inputs(const std::vector<DrawnInput>& inputs, std::uint64_t seed);

/// As many starts as the protocol says. The first starts stay the same if the number changes.
std::vector<Start> draw_starts(const StartProtocol& protocol);

inline constexpr std::size_t kMostSobolDimensions = 6;

/// The point of this number, counted from 0, of Sobol's sequence in [0, 1) (Sobol' 1967, USSR Comput Math Math Phys
/// 7:86) with the direction numbers of Joe and Kuo 2008 (SIAM J Sci Comput 30:2635). Points fill the cube evenly; the
/// first 2^k of them best. Point 0 is 0 in all dimensions. `number` is below 2^32.
std::array<double, kMostSobolDimensions> sobol_point(std::size_t number);

}  // namespace compare
}  // namespace marrow
