// SPDX-License-Identifier: Apache-2.0
#include "plugins/edges/roberts.cpp"

#include <numeric>

static marrow::EdgeMap find_edges(const marrow::View& view) { return roberts(view, {}); }

#include "edges/checks.hpp"
