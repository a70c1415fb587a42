// SPDX-License-Identifier: Apache-2.0
#include "nodes.hpp"
#include "plugins/optimizer/levenberg_marquardt.cpp"

std::shared_ptr<const marrow::Optimizer> optimizer_node() { return levenberg_marquardt(); }
