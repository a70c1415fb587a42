// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/prewitt.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return prewitt(view, {}); }

#include "edges/checks.hpp"
