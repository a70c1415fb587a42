// SPDX-License-Identifier: Apache-2.0
#pragma once
// The random draws of an experiment. They depend only on its seeds and are the same on every machine.
#include <vector>

#include "marrow/base/export.hpp"
#include "marrow/compare/experiment.hpp"

namespace MARROW_EXPORT_TO_TESTS marrow {
namespace compare {

/// The values of the drawn inputs, in their order.
std::vector<InputValue> draw_inputs(const std::vector<DrawnInput>& inputs, std::uint64_t seed);

/// As many starts as the protocol says. The first starts stay the same if the number changes.
std::vector<Start> draw_starts(const StartProtocol& protocol);

}  // namespace compare
}  // namespace marrow
