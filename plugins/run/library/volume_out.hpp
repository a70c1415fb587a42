// SPDX-License-Identifier: Apache-2.0
#pragma once
// Volumes in the formats that programs of others read.
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/volume.hpp"

namespace marrow::run {

/// mha, nrrd, nii, nii.gz.
std::vector<std::string> formats_of_volumes();

/// Writes samples without compression, but for nii.gz. The axes are LPS in MHA and NRRD, and RAS in NIfTI. Throws Error
/// if the grid is empty, if the number of samples is another, or if the file cannot be written.
void write_volume(const std::filesystem::path& file, const std::string& format, const Grid& grid,
                  const std::vector<float>& samples);
void write_volume(const std::filesystem::path& file, const std::string& format, const Grid& grid,
                  const std::vector<std::uint8_t>& samples);

}  // namespace marrow::run
