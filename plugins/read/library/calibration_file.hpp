// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/calibration.hpp"

namespace marrow::read {

/// Reads a calibration file in the format that marrow writes. Throws Error if it cannot be read, or for missing or
/// wrong values.
Calibration read_calibration_file(const std::filesystem::path& path);

}  // namespace marrow::read
