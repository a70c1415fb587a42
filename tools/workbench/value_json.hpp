// SPDX-License-Identifier: Apache-2.0
#pragma once
// Values as the pages get them, and back.
#include <nlohmann/json.hpp>

#include "marrow/domain/camera.hpp"

namespace marrow::workbench {

/// A 4 x 4 matrix as rows.
nlohmann::json json_of(const RigidTransform& target_from_source);
/// {intrinsics, camera_from_world, width_px, height_px} with matrices as rows.
nlohmann::json json_of(const Camera& camera);

}  // namespace marrow::workbench
