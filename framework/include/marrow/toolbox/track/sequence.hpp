// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/runtime/value.hpp"

namespace marrow::track {

/// What all devices show at one moment of a sequence: a view of each, with different names.
struct SequenceFrame {
  std::vector<View> views;

  using fields = Fields<&SequenceFrame::views>;
};

}  // namespace marrow::track

MARROW_VALUE_TYPE(marrow::track::SequenceFrame, "sequence_frame", 1)
