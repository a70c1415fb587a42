// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads values that marrow keeps in YAML files: transforms, poses, cameras and seeds (docs/case.md).
#include "marrow/domain/verdict.hpp"
#include "marrow/domain/volume.hpp"
#include "marrow/toolbox/files/camera_file.hpp"

namespace marrow::files {

/// A transform from the keys `target`, `source` and either `rotation` with `translation_mm` or one 4x4 `matrix`. Its
/// frames must be those of `expected`. Faults are noted in the map's file.
std::optional<RigidTransform> transform_from(const YamlMap& map, const RigidTransform& expected);
/// The keys that transform_from() reads.
const std::vector<std::string>& transform_keys();

/// A detector from the keys source_mm, corner_mm (of the first pixel's centre) or centre_mm (of the image), columns,
/// rows and pixel_mm. Faults are noted in the map's file.
std::optional<Detector> detector_from(const YamlMap& map, int width_px, int height_px);

/// A camera from the keys width_px, height_px, then intrinsics with camera_from_world, or one of c_arm,
/// projection_matrix and detector; for distorted images, radial_distortion or distortion; and deviations. Faults are
/// noted in `file`.
std::optional<CameraInFile> camera_from(const YAML::Node& node, YamlFile& file);

/// Seeds of one fragment from the map's keys `seeds` and `register`.
Seeds seeds_from(const YamlMap& map, const std::string& fragment);

/// Notes a fault unless the map has `key: 1`.
void check_version(const YamlMap& map, const std::string& key);

/// Reads a pose file in the format that marrow writes. Throws Error with all faults.
Pose read_pose_file(const std::filesystem::path& path);
/// Reads a verdict file in the format that marrow writes. Throws Error with all faults.
Verdict read_verdict_file(const std::filesystem::path& path);
/// Reads a file of seeds. Throws Error with all faults.
List<Seeds> read_seeds_file(const std::filesystem::path& path);

}  // namespace marrow::files
