// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "marrow/compare/experiment.hpp"
#include "marrow/runtime/executor.hpp"

namespace marrow::compare {

/// What came of one cell.
struct CellRow {
  std::string id, variant, case_name, start;
  std::string failed;                          ///< why; empty for a cell that is done
  int tries = 1;
  std::vector<std::optional<double>> values;   ///< of the experiment's metrics, in their order
  std::optional<double> initial_error;
  std::vector<std::string> units;              ///< of the metrics
  double seconds = 0;                          ///< of all its nodes, those read back included with what they took then
  int evaluations = 0;                         ///< of the cost, by all poses of the cell
  struct Calls {
    int made = 0, cached = 0;
    double seconds = 0;
  };
  std::map<std::string, Calls> nodes;          ///< by the node's name in the pipeline
  std::vector<std::string> files;              ///< pictures, relative to the comparison's folder
  std::string key;                             ///< of all that it depends on; another key, and the row is of no use

  /// Whether it is done and within every limit of the experiment.
  bool is_success(const Experiment& experiment) const;
};

std::string to_json(const CellRow& row);
/// Throws Error for a text that is no row.
CellRow row_from_json(const std::string& text);

/// Runs cells of one experiment. Results go to FOLDER/cells/ID/ (pictures, the run's record) and FOLDER/cells/ID/cell.json,
/// which is written last and in one go.
class CellRunner {
 public:
  CellRunner(const Experiment& experiment, const Catalogue& catalogue, const Store* store, std::filesystem::path folder, int threads);

  /// Where a case lies, or will lie once it was simulated.
  std::filesystem::path case_place(std::size_t case_index) const;
  /// The folder of a case; a simulated one is made where it is not in the store yet. Throws Error when that fails.
  std::filesystem::path case_folder(std::size_t case_index);
  /// The row that is there already, where it is whole and of the same experiment, data and plugins.
  std::optional<CellRow> finished(const CellIndex& cell);
  /// Never throws for what goes wrong in a node: that is the row's reason.
  CellRow run(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer = {});
  /// Writes the row where finished() finds it.
  void write(const CellRow& row) const;
  std::filesystem::path folder_of(const CellIndex& cell) const;
  const Experiment& experiment() const { return experiment_; }
  std::string key_of(const CellIndex& cell);
  /// The pipeline of a cell, with the outputs that the experiment asks for.
  Pipeline pipeline_of(const CellIndex& cell, const std::filesystem::path& case_folder) const;

 private:
  Pipeline simulation_of(std::size_t case_index) const;
  void simulate(std::size_t case_index, const std::filesystem::path& folder) const;

  const Experiment& experiment_;
  const Catalogue& catalogue_;
  const Store* store_;
  std::filesystem::path folder_;
  int threads_;
  std::map<std::size_t, std::filesystem::path> case_folders_;
  std::map<std::size_t, std::string> case_keys_;
};

}  // namespace marrow::compare
