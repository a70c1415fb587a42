// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/domain/calibration.hpp"

namespace marrow::calibration {

/// Views of a board that is never tilted do not tell the focal length; only their noise seems to. Throws Error if the
/// focal length is not known to a tenth of itself (one standard deviation), and gives a sentence to warn with if it is
/// not known to a hundredth; else an empty text. `views` names what the calibration is from, such as "the photographs".
std::string doubtful_focal_length(const Calibration& calibration, const std::string& views);

}  // namespace marrow::calibration
