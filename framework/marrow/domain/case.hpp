// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "marrow/domain/camera.hpp"
#include "marrow/domain/pose.hpp"
#include "marrow/domain/volume.hpp"

namespace MARROW_EXPORT marrow {

/// One patient: a CT, seeds for each fragment, and the views with their cameras. Start poses and exact poses are
/// included if they are known. On disk, a case is a folder with case.yaml (docs/case.md).
struct Case {
  Volume ct;
  List<Seeds> seeds;  ///< axis fragment
  List<View> views;   ///< axis view
  List<Pose> start;   ///< axis fragment; empty if the case has none
  List<Truth> truth;  ///< axis fragment; empty if the case has none
  using fields = Fields<&Case::ct, &Case::seeds, &Case::views, &Case::start, &Case::truth>;
};

}  // namespace marrow
