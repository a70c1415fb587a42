// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marrow/compare/experiment.hpp"
#include "marrow/runtime/executor.hpp"

namespace marrow::compare {

/// What came of one cell.
struct CellRow {
  std::string id, variant, case_name, start;
  std::string failed;  ///< why; empty for a cell that is done
  int tries = 1;
  std::vector<std::optional<double>> values;  ///< of the experiment's metrics, in their order
  std::optional<double> initial_error;
  std::vector<std::string> units;  ///< of the metrics
  std::optional<double> seconds;   ///< measured with nothing else running; without what all variants share
  int evaluations = 0;             ///< of the cost, by all poses of the cell
  struct Calls {
    int made = 0, cached = 0;
    double seconds = 0;
  };
  std::map<std::string, Calls> nodes;  ///< by the node's name in the pipeline
  std::string key;                     ///< of all that it depends on; another key, and the row is of no use

  /// Whether it is done and within every limit of the experiment.
  bool is_success(const Experiment& experiment) const;
};

std::string to_json(const CellRow& row);
/// A row of the experiment from its text. Throws Error for a text that is none. Which cell it is of is not believed:
/// call name_row() with the cell that was asked for.
CellRow row_from_json(const std::string& text, const Experiment& experiment);
/// Says in the row which cell it is of.
void name_row(CellRow& row, const Experiment& experiment, const CellIndex& cell);
/// The row of a cell that has none, because of `reason`.
CellRow failed_row(const Experiment& experiment, const CellIndex& cell, const std::string& reason, int tries);

/// What each node will come to, as far as that can be said before anything ran: equal for equal nodes of equal
/// histories. `case_name` stands for all data that paths name and for the seed of what is random.
std::vector<Digest> histories(const Pipeline& pipeline, const std::string& case_name);

/// Whether a node comes out otherwise for another case, or another start, of the same variant.
struct Dependence {
  bool on_case = false, on_start = false;
};
std::vector<Dependence> dependences(const Pipeline& pipeline, const Experiment& experiment);

/// What cells depend on beside the texts of the experiment and its pipelines, as it was when it was looked at.
struct Dependencies {
  std::map<std::string, std::string> contents;  ///< of what paths name, by path
  std::map<std::string, Digest> builds;         ///< of the plugins, by node
};
/// The first path, or in words the first plugin, that is another one by now; empty where all are the same.
std::string first_change(const Dependencies& before, const Catalogue& now);

/// Runs cells of one experiment. Results go to FOLDER/cells/ID/ (poses, figures, the run's record) and
/// FOLDER/cells/ID/cell.json, which is written last and in one go; what there is to look at goes to
/// FOLDER/pictures/ID/.
class CellRunner {
 public:
  CellRunner(const Experiment& experiment, const Catalogue& catalogue, const Store* store, std::filesystem::path folder,
             int threads, const FileLimits& file_limits = {});

  /// The seed of a case's runs.
  std::uint64_t seed_of(std::size_t case_index) const;
  /// Where a case lies, or will lie once it was simulated; empty where the pipeline makes its data itself.
  std::filesystem::path case_place(std::size_t case_index) const;
  /// The folder of a case; a simulated one is made where it is not in the store yet. Throws Error when that fails.
  std::filesystem::path case_folder(std::size_t case_index);
  /// From now on every path is looked at once: for a process that asks others to run cells, and must tell them all
  /// the same.
  void keep_dependencies() { keeps_dependencies_ = true; }
  /// What was looked at since.
  const Dependencies& dependencies() const { return dependencies_; }
  /// Of all that a run of the cell, and its row, depend on. Empty where that cannot be told; its run says why.
  std::string key_of(const CellIndex& cell);
  /// The row that is there already, where it is whole and has this key.
  std::optional<CellRow> finished(const CellIndex& cell, const std::string& key) const;
  /// Never throws for what goes wrong in a node: that is the row's reason.
  CellRow run(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer = {});
  /// Runs the cell again for its pictures, landscape and scene; its other nodes are read back from the store. False
  /// where they were there already. Throws Error where the folder cannot be written.
  bool draw(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer = {});
  /// Seconds that a run of the cell takes when the results that all variants share are read back and all others are
  /// made anew. Measured once: later runs with as many threads find it in the store. Throws Error where the run fails.
  double time(const CellIndex& cell);
  std::filesystem::path pictures_of(const CellIndex& cell) const;
  /// Writes the row where finished() finds it. Where it cannot be written, the row fails by that: it costs the cell
  /// alone.
  void write(const CellIndex& cell, CellRow& row) const;
  std::filesystem::path folder_of(const CellIndex& cell) const;
  const Experiment& experiment() const { return experiment_; }
  enum class Depth { figures, pictures };
  /// The pipeline of a cell, with its poses and the outputs that the experiment's metrics need, and those that are
  /// looked at.
  Pipeline pipeline_of(const CellIndex& cell, const std::filesystem::path& case_folder, Depth depth) const;

 private:
  enum class Look { may_be_kept, anew };
  std::string content_of(const std::string& path, Look look) const;
  void add_pipeline(Hasher& hasher, const Pipeline& pipeline, const std::filesystem::path& case_folder,
                    Look look) const;
  std::string key_of(const CellIndex& cell, const Pipeline& pipeline);
  /// What a run depends on, with the times of its files: another one where any was written to, even if it holds the
  /// same again.
  struct Watched {
    Digest states;
    std::string key;
    bool operator==(const Watched&) const = default;
  };
  Watched watched(const CellIndex& cell, const Pipeline& pipeline);
  std::filesystem::path place_of_simulated(std::size_t case_index, Look look) const;
  struct Done {
    RunResult result;
    std::string fault;  ///< of the first node that failed, or of an output that could not be written
  };
  Done run_into(const std::filesystem::path& folder, const Pipeline& pipeline, const CellIndex& cell,
                const std::function<void(const RunEvent&)>& observer);
  void fill(CellRow& row, const Pipeline& pipeline, const Done& done) const;
  Pipeline simulation_of(std::size_t case_index) const;
  /// The nodes of the cell that not all variants have in common.
  std::set<std::string> own_nodes(const CellIndex& cell, const Pipeline& pipeline);
  void simulate(std::size_t case_index, const std::filesystem::path& folder) const;

  const Experiment& experiment_;
  const Catalogue& catalogue_;
  const Store* store_;
  std::filesystem::path folder_;
  int threads_;
  FileLimits file_limits_;
  bool keeps_dependencies_ = false;
  mutable Dependencies dependencies_;
  mutable std::map<std::size_t, std::filesystem::path> places_;  ///< of simulated cases, where dependencies are kept
  struct FoundCase {
    std::filesystem::path outputs;
    std::shared_ptr<const void> use;  ///< while it lives, no tidying of the store removes the folder
  };
  std::map<std::size_t, FoundCase> simulated_;
};

}  // namespace marrow::compare
