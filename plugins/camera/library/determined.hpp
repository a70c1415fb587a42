// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>

#include "marrow/domain/calibration.hpp"

namespace marrow::calibration {

/// Views of a board that is never tilted do not determine the focal length, although noise gives it a value. Throws
/// Error if its standard deviation is more than a tenth of it. Returns a warning if it is more than a hundredth, else
/// an empty text. `views` names what the calibration is from, such as "the photographs".
std::string doubtful_focal_length(const Calibration& calibration, const std::string& views);

}  // namespace marrow::calibration
