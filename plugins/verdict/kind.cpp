// SPDX-License-Identifier: Apache-2.0
// The kind of nodes that say whether a pose can be relied on. They never see the truth.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("verdict")
      .summary("whether a pose can be relied on: trusted, doubtful or wrong, with reasons")
      .in<marrow::Pose>("pose", "pose to judge")
      .in<marrow::Pose>("contour_pose", "another pose of the same bone, found by its contour")
      .in<marrow::Pose>("stages", "poses of the search for the pose", marrow::over("stage"))
      .in<marrow::Cost>("cost", "cost of a pose, of grey values")
      .in<marrow::Cost>("contour_cost", "cost of a pose, of the contour")
      .in<marrow::Optimizer>("optimizer", "minimiser of the costs")
      .in<marrow::View>("views", "X-ray views", marrow::over("view"))
      .in<marrow::EdgeMap>("edges", "edge pixels of each view", marrow::over("view"))
      .in<marrow::OutlineProjector>("projector", "draws the bone's outline for any camera and pose")
      .in<marrow::Mesh>("model", "surface of the bone; it gives the axes and the targets")
      .in<marrow::Pose>("others", "poses of other fragments", marrow::over("fragment"))
      .in<marrow::Pose>("other", "another pose of the same bone, with its cost")
      .in<marrow::SignedField>("other_bones", "the other fragments' bone", marrow::over("fragment"))
      .out<marrow::Verdict>("verdict", "judgement of the pose, with the probability that it is off");
}
