// SPDX-License-Identifier: Apache-2.0
#include "plugins/shaft/ransac.cpp"

static const char* const kNode = "shaft.ransac";

static marrow::ShaftLines find_shaft(const marrow::EdgeMap& edges, const marrow::View& view,
                                     const LineOptions& lines = {}) {
  Options options;
  static_cast<LineOptions&>(options) = lines;
  marrow::Context context(1);
  return ransac(edges, view, options, context);
}

#include "shaft/checks.hpp"
#include "shaft/drawn_checks.hpp"
