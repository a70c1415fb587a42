// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "header_lines.hpp"

namespace marrow::files {

/// The fields of a NRRD header without axes that hold one sample and are none of the three of the volume: one value for
/// each voxel, one label map, one point in time. Their order in the file does not matter, because each has one sample.
/// If there are more than three other axes, or the fields contradict each other, they stay for the reader to refuse.
HeaderFields without_single_samples(HeaderFields fields);

}  // namespace marrow::files
