// SPDX-License-Identifier: Apache-2.0
#define marrow_plugin_entry marrow_plugin_entry_of_optimizer
#include "nodes.hpp"
#include "plugins/optimizer/levenberg_marquardt.cpp"

std::shared_ptr<const marrow::Optimizer> optimizer_node() {
  return levenberg_marquardt();
}
