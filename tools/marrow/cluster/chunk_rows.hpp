// SPDX-License-Identifier: Apache-2.0
#pragma once
// The files in which the tasks of a cluster leave the rows of their cells: FOLDER/rows/CHUNK.jsonl. While a task runs,
// its file is CHUNK.PROCESS.part, a name that no other process on any host uses. It is renamed when it has all rows.
// Each row holds its own digest, so the rows of a killed task count too.
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

/// Writes FOLDER/rows/CHUNK.fault: why a task could not do its chunk, in one sentence. The task's output may be on
/// another host. If the file cannot be written, that is ignored: the task prints the sentence, too.
void leave_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk, const std::string& fault);
/// Call this when the chunk is done.
void remove_fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);
/// The sentence, without control characters; empty if there is none.
std::string fault_of_chunk(const std::filesystem::path& folder, const std::string& chunk);

/// What tasks left in a folder.
class RowsOfChunks {
 public:
  /// Leaves out lines that are damaged or of another experiment. Rows of failed cells count only if they are of this
  /// plan; `plan` may be empty. If `cells` is not empty, only rows of these cells are read completely: a task reads the
  /// files of all others, and must not spend time on rows that it does not need.
  RowsOfChunks(const std::filesystem::path& folder, const compare::Experiment& experiment, const std::string& plan,
               std::set<std::string> cells = {});

  /// A row of the finished cell. Its key is `key`, but may be of another machine. Of several rows, the one that this
  /// machine made, else the first in the order of their texts. It gets the names of the cell.
  std::optional<compare::CellRow> done(const compare::CellIndex& cell, const std::string& key) const;
  /// Whether a row with the same key as `taken`, or that of another machine, has another result.
  bool contradicts(const compare::CellIndex& cell, const compare::CellRow& taken) const;
  /// A row that says why the cell failed. Of several, the first in the order of their texts.
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
