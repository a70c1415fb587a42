// SPDX-License-Identifier: Apache-2.0
// Nodes that find the pose that explains the data best.
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("register")
      .summary("pose of least cost, with its predicted uncertainty")
      .in<marrow::Cost>("cost", "what a pose costs")
      .in<marrow::Cost>("finer_cost", "what a pose costs, told from near")
      .in<marrow::Optimizer>("optimizer", "minimiser")
      .in<marrow::Optimizer>("finer_optimizer", "minimiser of finer_cost; none: the same")
      .in<marrow::Pose>("initial", "pose to start from, and the fragment's axes")
      .in<marrow::Mesh>("model", "surface of the fragment")
      .in<marrow::Mesh>("target", "surface in the world, whole or a part")
      .out<marrow::Pose>("pose", "pose of least cost, with its predicted covariance")
      .out<marrow::Pose>("stages", "poses on the way, from the start to the final one", marrow::over("stage"));
}
