// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>

#include "header_lines.hpp"

namespace marrow::files {

/// The fields of a NRRD header without the axes that hold one sample and do not belong to the volume: one value per
/// voxel, one label map, one point in time. Their order in the file does not matter, because each has one sample. More
/// than three other axes, or fields that contradict each other, are left for the reader to refuse.
HeaderFields without_single_samples(HeaderFields fields);

/// The axis of a header of four axes that is not one of space: the layers of a segmentation. Several samples lie along
/// it. std::nullopt if there is none.
std::optional<std::size_t> axis_of_layers(const HeaderFields& fields);

/// The fields without what they say of this axis.
HeaderFields without_axis(HeaderFields fields, std::size_t axis);

}  // namespace marrow::files
