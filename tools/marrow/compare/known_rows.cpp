// SPDX-License-Identifier: Apache-2.0
#include "compare/known_rows.hpp"

#include <cstdio>

#include "commands.hpp"
#include "marrow/base/number_text.hpp"
#include "marrow/base/printable.hpp"
#include "marrow/base/remove_tree.hpp"

namespace marrow::cli {
namespace {

namespace fs = std::filesystem;
using compare::CellRow;

/// Removes what an earlier run left of a cell in this folder. If that is not possible, says so.
void remove_old_outputs(const compare::CellRunner& runner, const compare::CellIndex& cell) {
  try {
    const fs::path folder = runner.folder_of(cell);
    if (fs::exists(folder)) remove_tree(folder);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "marrow: outputs of an earlier run stay: %s\n", printable(error.what()).c_str());
  }
}

}  // namespace

void KnownRows::Remark::add(const std::string& what) {
  if (!cells++) first = what;
}

std::optional<CellRow> KnownRows::done(const compare::CellIndex& cell, const std::string& key) {
  std::optional<CellRow> row = runner_.finished(cell, key);
  if (!row) {
    if (const std::string fault = runner_.fault_of_row(cell); !fault.empty())
      changed_.add((runner_.folder_of(cell) / "cell.json").string() + ": " + fault);
    row = chunks_.done(cell, key);
    if (row) remove_old_outputs(runner_, cell);
  }
  if (row && chunks_.contradicts(cell, *row)) contradicting_.add(row->id);
  return row;
}

std::optional<CellRow> KnownRows::failed(const compare::CellIndex& cell) const {
  remove_old_outputs(runner_, cell);
  return chunks_.failed(cell);
}

void KnownRows::say_doubts() const {
  if (changed_.cells)
    say_note(changed_.cells == 1
                 ? "1 row is not as marrow wrote it, so it does not count: " + changed_.first
                 : formatted("{} rows are not as marrow wrote them, so they do not count: {}, and others",
                             changed_.cells, changed_.first));
  if (contradicting_.cells)
    say_note(
        formatted("{} rows with different results, from several hosts or times, such as {}. A row from a machine like "
                  "this one is taken, or else the first in the order of their texts",
                  counted(contradicting_.cells, "cell has", "cells have"), contradicting_.first));
}

}  // namespace marrow::cli
