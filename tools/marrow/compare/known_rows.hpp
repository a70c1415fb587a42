// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <optional>
#include <string>

#include "cluster/chunk_rows.hpp"

namespace marrow::cli {

/// The rows of a comparison that were made before, here or by tasks of a cluster. A row counts only if its key is that
/// of the cell's present dependencies, and if nobody changed it.
class KnownRows {
 public:
  /// `plan` as for RowsOfChunks.
  KnownRows(const compare::Experiment& experiment, const compare::CellRunner& runner,
            const std::filesystem::path& folder, const std::string& plan)
      : runner_(runner), chunks_(folder, experiment, plan) {}

  /// The row of a cell that is done. If a task made it, what an earlier run left of the cell in this folder is removed,
  /// because its outputs are not those of the row.
  std::optional<compare::CellRow> done(const compare::CellIndex& cell, const std::string& key);
  /// A task's row of a cell that is not done, which says why; nothing if no task left one. What an earlier run left of
  /// the cell is removed.
  std::optional<compare::CellRow> failed(const compare::CellIndex& cell) const;
  /// Says which rows were not believed, and which contradict each other.
  void say_doubts() const;

 private:
  /// What one note says: the number of cells, and the first one.
  struct Remark {
    std::size_t cells = 0;
    std::string first;
    void add(const std::string& what);
  };

  const compare::CellRunner& runner_;
  RowsOfChunks chunks_;
  Remark changed_, contradicting_;
};

}  // namespace marrow::cli
