// SPDX-License-Identifier: Apache-2.0
#pragma once
// What an experiment draws at random, from its seeds alone: the same on any machine.
#include <string>
#include <vector>

#include "marrow/compare/experiment.hpp"

namespace marrow::compare {

/// A number as it is written on the command line.
std::string number_text(double value);

/// The values of the drawn inputs, in their order.
std::vector<InputValue> draw_inputs(const std::vector<DrawnInput>& inputs, std::uint64_t seed);

/// As many starts as the protocol says. The first ones do not depend on their number.
std::vector<Start> draw_starts(const StartProtocol& protocol);

}  // namespace marrow::compare
