// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <memory>

#include "marrow/domain/functions.hpp"

namespace marrow::match {

/// A projector whose radiographs are as smooth as an image smoothed by a Gaussian of `sigma_px`, wherever the model is:
/// at each pose the model is smoothed by that many pixels at the depth of its own middle. For cameras that do not tell
/// how far away the bone is. Null if `projector`, which must outlive it, cannot be smoothed.
std::shared_ptr<const RadiographProjector> smoothed_at_bone(const RadiographProjector& projector, double sigma_px);

}  // namespace marrow::match
