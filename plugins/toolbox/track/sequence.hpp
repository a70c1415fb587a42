// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <string>
#include <vector>

#include "marrow/base/number_text.hpp"
#include "marrow/domain/camera.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::track {

/// How a frame is called in lists over "frame": its number from 1, with four digits at least.
inline std::string frame_name(std::size_t number) { return formatted("{:04}", number); }

/// What all devices show at one moment of a sequence: a view of each, with different names.
struct SequenceFrame {
  std::vector<View> views;

  using fields = Fields<&SequenceFrame::views>;
};

}  // namespace marrow::track

MARROW_VALUE_TYPE(marrow::track::SequenceFrame, "sequence_frame", 1)
