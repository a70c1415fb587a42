// SPDX-License-Identifier: Apache-2.0
#include "plugins/shaft/hough_pairs.cpp"

static const char* const kNode = "shaft.hough_pairs";

static marrow::ShaftLines find_shaft(const marrow::EdgeMap& edges, const marrow::View& view,
                                     const LineOptions& options = {}) {
  return hough_pairs(edges, view, options);
}

#include "shaft/checks.hpp"
#include "shaft/drawn_checks.hpp"
