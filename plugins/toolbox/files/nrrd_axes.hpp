// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "header_lines.hpp"

namespace marrow::files {

/// The fields of a NRRD header without the axes that hold one sample and do not belong to the volume: one value per
/// voxel, one label map, one point in time. Their order in the file does not matter, because each has one sample. More
/// than three other axes, or fields that contradict each other, are left for the reader to refuse.
HeaderFields without_single_samples(HeaderFields fields);

}  // namespace marrow::files
