// SPDX-License-Identifier: Apache-2.0
#pragma once
// The values of measures, and their quadratic models.
#include "marrow/similarity/intensity.hpp"

namespace marrow::match {

double value_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks);

bool has_derivatives(const Measure& measure);

/// For a measure that has derivatives and a patch with slopes. `worst` counts where the patch is empty or the measure
/// is not finite.
ViewsCost::ViewExpansion expansion_of(const Measure& measure, const Patch& patch, double step_px, const Blocks& blocks,
                                      double worst);

/// sum += share * more.
void add(const Cost::Expansion& more, double share, Cost::Expansion& sum);

}  // namespace marrow::match
