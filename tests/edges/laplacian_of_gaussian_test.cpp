// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/laplacian_of_gaussian.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return laplacian_of_gaussian(view, {}); }

#include "edges/checks.hpp"
