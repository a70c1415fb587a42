// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/sobel.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return sobel(view, {}); }

#include "edges/checks.hpp"
