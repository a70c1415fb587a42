// SPDX-License-Identifier: Apache-2.0
#include <marrow/plugin.hpp>

MARROW_PLUGIN(plugin) {
  plugin.kind("register")
      .summary("pose of least cost, with its predicted uncertainty")
      .in<marrow::Cost>("cost", "cost of a pose")
      .in<marrow::Cost>("finer_cost", "cost of a pose for a second search, near the result of the first")
      .in<marrow::Optimizer>("optimizer", "minimiser")
      .in<marrow::Optimizer>("finer_optimizer", "minimiser of finer_cost; none: the same as for cost")
      .in<marrow::Pose>("start", "pose to start from, and the fragment's axes")
      .in<marrow::Cost>("costs", "costs of several bones", marrow::over("fragment"))
      .in<marrow::Pose>("starts", "poses of several bones to start from", marrow::over("fragment"))
      .in<marrow::Mesh>("models", "surfaces of these bones", marrow::over("fragment"))
      .in<marrow::Mesh>("model", "surface of the fragment")
      .in<marrow::Mesh>("target", "surface in world coordinates, of the whole fragment or a part")
      .out<marrow::Pose>("pose", "pose of least cost, with its predicted covariance")
      .out<marrow::Pose>("stages", "poses of the search, from the start to the final one", marrow::over("stage"));
}
