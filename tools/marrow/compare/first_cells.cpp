// SPDX-License-Identifier: Apache-2.0
#include "compare/first_cells.hpp"

#include <algorithm>

#include "marrow/base/error.hpp"

namespace marrow::cli {

void FirstCells::add(const compare::CellIndex& cell, const compare::CellRow& row) {
  any_done_ |= row.failed.empty();
  if (any_done_ || !row.lacks_figure) return;
  variants_.insert(cell.variant);
  cases_.insert(cell.case_index);
  if (variants_.size() < experiment_.variants.size() ||
      cases_.size() < std::min<std::size_t>(2, experiment_.cases.size()))
    return;
  throw Error(row.failed +
              "; this is so in the first cells of all variants, so the others were not run; name another "
              "figure in " +
              experiment_.file.string());
}

}  // namespace marrow::cli
