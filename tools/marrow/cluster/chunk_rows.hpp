// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files in which the tasks of a cluster leave the rows of their cells: FOLDER/rows/CHUNK.jsonl. While a task runs,
// its file is CHUNK.PROCESS.part, by which it is known among the processes of all hosts. It is renamed when all rows
// are there. Each row has a digest of itself, so the rows of a task that was killed count too.
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marrow/base/descriptor.hpp"
#include "marrow/compare/cell.hpp"

namespace marrow::cli {

/// Writes the rows of one chunk.
class ChunkFile {
 public:
  /// Throws Error if the file cannot be made.
  ChunkFile(const std::filesystem::path& folder, const std::string& chunk);

  /// Throws Error if the row cannot be written.
  void add(const compare::CellRow& row);
  /// All rows are there: the file gets its final name. Throws Error if that fails.
  void finish();

 private:
  void expect_good(bool is_good) const;

  std::filesystem::path final_, part_;
  Descriptor descriptor_;
};

/// The chunks that have a file: true if it has its final name. The folder is listed, because on a shared folder a file
/// that was absent before may seem to be absent still.
std::map<std::string, bool> chunk_files(const std::filesystem::path& folder);

/// What tasks left in a folder.
class RowsOfChunks {
 public:
  /// Lines that are damaged, or of another experiment, are left out. Rows of failed cells count only if they are of
  /// this plan; `plan` may be empty. With `cells`, only rows of the cells of these names are taken: a task reads what
  /// all others left, so it should do little for a row that it does not need.
  RowsOfChunks(const std::filesystem::path& folder, const compare::Experiment& experiment, const std::string& plan,
               std::set<std::string> cells = {});

  /// A row of the cell that is done and has this key, except for the machine. Of several, one that this machine made
  /// (its key is the same as a whole), else the first in the order of their texts. It has the names of the cell.
  std::optional<compare::CellRow> done(const compare::CellIndex& cell, const std::string& key) const;
  /// Whether a row with the key of the one that is taken, except for the machine, has another result.
  bool contradicts(const compare::CellIndex& cell, const compare::CellRow& taken) const;
  /// A row of the cell that says why it failed. Of several, the first in the order of their texts.
  std::optional<compare::CellRow> failed(const compare::CellIndex& cell) const;

 private:
  void add_file(const std::filesystem::path& file, bool is_of_plan);
  void add_line(const std::string& line, bool is_of_plan);
  bool is_wanted(const std::string& line) const;
  std::vector<compare::CellRow> rows_of(const compare::CellIndex& cell, const std::string& key) const;

  const compare::Experiment& experiment_;
  std::set<std::string> cells_;
  std::map<std::string, std::vector<compare::CellRow>> done_;  ///< by the name of the cell
  std::map<std::string, compare::CellRow> failed_;
};

}  // namespace marrow::cli
