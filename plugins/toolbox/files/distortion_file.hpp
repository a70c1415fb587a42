// SPDX-License-Identifier: Apache-2.0
#pragma once
// A distortion that was measured with a plate, as marrow keeps it in YAML (docs/case.md).
#include <filesystem>
#include <optional>
#include <string>

#include "marrow/toolbox/distortion/distortion.hpp"
#include "marrow/toolbox/files/strict_yaml.hpp"

namespace marrow::files {

/// A distortion from the keys width_px, height_px, degree, terms_px, lattice, area_px, residual_px and validated_px.
/// All but the lattice are required. Faults are noted in `file`.
std::optional<distortion::Distortion> distortion_from(const YAML::Node& node, YamlFile& file);

/// Reads a distortion file in the format that marrow writes. Throws Error with all faults.
distortion::Distortion read_distortion_file(const std::filesystem::path& path);

/// The file that read_distortion_file() reads back without loss.
std::string distortion_text(const distortion::Distortion& distortion);

}  // namespace marrow::files
