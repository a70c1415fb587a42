// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>

#include "marrow/domain/calibration.hpp"

namespace marrow::files {

/// A calibration file, as the writer of calibrations makes it. Throws Error.
Calibration read_calibration_file(const std::filesystem::path& path);

}  // namespace marrow::files
