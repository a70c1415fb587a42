// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that improve what a pipeline was given, by what it has found.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("refine")
      .summary("cameras and poses that fit the images better")
      .in<marrow::View>("views", "X-ray views with the cameras that a calibration gives", marrow::over("view"))
      .in<marrow::Cost>("costs", "cost of each bone's pose in these views", marrow::over("fragment"))
      .in<marrow::Pose>("poses", "pose of each bone, from a registration", marrow::over("fragment"))
      .out<marrow::View>("views", "the same images with corrected cameras", marrow::over("view"))
      .out<marrow::Pose>("poses", "poses that go with these cameras", marrow::over("fragment"));
}
