// SPDX-License-Identifier: Apache-2.0
#include "plugins/shaft/line_segments.cpp"

static const char* const kNode = "shaft.line_segments";

static marrow::ShaftLines find_shaft(const marrow::EdgeMap& edges, const marrow::View& view,
                                     const LineOptions& lines = {}) {
  Options options;
  static_cast<LineOptions&>(options) = lines;
  return line_segments(edges, view, options);
}

#include "shaft/checks.hpp"
