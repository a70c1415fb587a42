// SPDX-License-Identifier: Apache-2.0
#pragma once
// A description of data in the manner of Utrecht's gold standard for 2D/3D registration (van de Kraats et al., IEEE TMI
// 24:1177, 2005): raw volumes and projections, a source and a detector for each projection, masks, and a table of
// starts. The description is marrow's YAML, because the data set's own texts are for people (docs/public-data.md).
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/domain/volume.hpp"

namespace marrow::exchange {

/// A view of an object, and where its image shows the object: empty if there is no mask.
struct UtrechtView {
  View view;
  cv::Mat1b object;
};

/// An object of interest, such as a vertebra.
struct UtrechtObject {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< about which the starts turn, in world coordinates
  std::vector<std::uint8_t> inside;                     ///< voxels of the volume; empty if there is no mask
};

/// A start: translations along, and rotations about, the world's axes.
struct UtrechtStart {
  Eigen::Vector3d translation_mm = Eigen::Vector3d::Zero(), rotation_deg = Eigen::Vector3d::Zero();
};

struct UtrechtData {
  Volume volume;
  RigidTransform world_from_volume{"world", "ct"};  ///< the gold standard
  List<UtrechtObject> objects;
  std::vector<UtrechtStart> starts;
};

/// Reads a description with the volume, masks in 3D and starts that it names. Throws Error with all faults of the
/// description, or if a file is missing or of another size.
UtrechtData read_utrecht(const std::filesystem::path& path);
/// The projections, with their masks of one object. Throws the same Errors.
List<UtrechtView> read_utrecht_views(const std::filesystem::path& path, const std::string& object);

/// The pose from which a start begins: the rotations about x, y and z in this order about the object's centre, then the
/// translation, applied to the gold standard.
RigidTransform started(const UtrechtStart& start, const RigidTransform& world_from_volume,
                       const Eigen::Vector3d& centre_mm);

}  // namespace marrow::exchange
