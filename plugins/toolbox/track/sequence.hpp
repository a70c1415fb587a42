// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "marrow/domain/camera.hpp"
#include "marrow/runtime/node/value.hpp"

namespace marrow::track {

/// How a frame is called in lists over "frame": its number from 1, with four digits at least.
inline std::string frame_name(std::size_t number) {
  char name[24];
  std::snprintf(name, sizeof name, "%04zu", number);
  return name;
}

/// What all devices show at one moment of a sequence: a view of each, with different names.
struct SequenceFrame {
  std::vector<View> views;

  using fields = Fields<&SequenceFrame::views>;
};

}  // namespace marrow::track

MARROW_VALUE_TYPE(marrow::track::SequenceFrame, "sequence_frame", 1)
