// SPDX-License-Identifier: Apache-2.0
#pragma once
// A label map that the page "Case" shows over the slices of a CT.
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "marrow/toolbox/files/label_file.hpp"

namespace marrow::workbench {

/// One byte pair a voxel says which segment it belongs to. Where segments overlap, it is the first of them.
struct OpenLabels {
  struct Segment {
    int number = 0;
    std::string name;  ///< empty if the file does not name it
    std::size_t voxels = 0;
    Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< the voxel of it that is nearest to its centre of mass
    nlohmann::json label;  ///< its `label` in a case: a name or a number; null if neither says which segment it is
  };
  std::string name;  ///< unique while the server runs
  Grid grid;
  std::vector<Segment> segments;
  std::vector<std::uint16_t> places;  ///< for each voxel: 0, or 1 + the index of its segment
};

/// Throws Error if it has more than 1000 segments: then it is no segmentation of a body.
OpenLabels open_labels(const files::LabelMap& map);

/// {name, grid: {size, spacing_mm}, segments: [{number, name, label, volume_ml, middle_mm}]}
nlohmann::json about_labels(const OpenLabels& labels);

/// The places of the nearest voxels in one slice of a CT, as uint16 in the order of slice_of(); 0 outside of the label
/// map's grid.
std::vector<std::uint16_t> labels_in_slice(const OpenLabels& labels, const Grid& ct, int axis, int index);

}  // namespace marrow::workbench
