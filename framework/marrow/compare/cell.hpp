// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "marrow/compare/experiment.hpp"
#include "marrow/domain/verdict.hpp"
#include "marrow/runtime/run/replay.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// The part of a cell's key that is the same on machines with other processors. Rows that such machines made belong to
/// the same comparison, although their last digits may differ.
std::string key_without_machine(const std::string& key);

/// A pose that a cell found.
struct CellPose {
  std::string output;                ///< the pipeline's name of it
  std::string item;                  ///< its place along the axes, as "distal"; empty if the output is no list
  std::string target, source;        ///< the frames between which the matrix leads, as "world" and "ct"
  std::array<double, 12> matrix{};   ///< the first three rows of the 4 x 4 matrix, row by row; translations in mm
  std::optional<Judgement> verdict;  ///< the worst of the verdicts on this item, or on the whole run; nothing without
  std::optional<double> failure_probability;  ///< the largest known one of these
  /// One predicted standard deviation: rotations about [deg] and translations along [mm] three axes. Empty if none was
  /// predicted. Nothing for a direction that the images do not determine.
  std::vector<std::optional<double>> deviations;
  bool has_bone_axes = false;  ///< the axes are the bone's frontal, lateral and long ones; else the model's x, y and z

  bool operator==(const CellPose&) const = default;
};

/// The result of one cell.
struct CellRow {
  std::string id, variant, case_name, start;
  std::string failed;  ///< why it failed; empty for a cell that is done
  std::string absent;  ///< why figures are missing in a cell that is done: a node failed that may fail
  /// It failed because the experiment names a figure, or an item of a list that a search makes, that is not there.
  bool lacks_figure = false;
  int tries = 1;
  std::vector<std::optional<double>> values;  ///< values of the experiment's metrics, in their order
  std::vector<std::string> units;             ///< units of the metrics
  std::optional<double> initial_error;
  std::string initial_error_unit;
  std::optional<double> seconds;  ///< measured with nothing else running, without what all variants share
  int evaluations = 0;            ///< number of cost evaluations, for all poses of the cell
  /// The worst judgement of the verdicts among its pipeline's outputs; nothing if there is no verdict.
  std::optional<Judgement> verdict;
  std::optional<double> failure_probability;                     ///< the largest known one of the verdicts
  using Figures = std::map<std::string, std::optional<double>>;  ///< nothing for a figure that is not finite
  std::map<std::string, Figures> verdict_figures;  ///< the figures behind each verdict, by its place: "verdict.distal"
  std::vector<CellPose> poses;                     ///< those among its pipeline's outputs; none of a cell that failed
  struct Calls {
    int made = 0, cached = 0;
    double seconds = 0;
  };
  std::map<std::string, Calls> nodes;  ///< by the node's name in the pipeline
  std::string key;  ///< key of everything that the row depends on; a row with another key cannot be used

  /// Whether it is done and within every limit of the experiment.
  bool is_success(const Experiment& experiment) const;
};

/// The row as one line of JSON. Its key "digest" is a digest of all other keys. So a row that was cut or changed later
/// is not taken for a result.
std::string to_json(const CellRow& row);
/// Why a text is not a row that to_json() wrote; empty if it is one. It may be a row of any experiment.
std::string fault_of_written_row(const std::string& text);
/// Parses a row of the experiment. Throws Error if the text is not a row that to_json() wrote. Ignores the names of the
/// cell in the text: call name_row() with the cell that was asked for.
CellRow row_from_json(const std::string& text, const Experiment& experiment);
/// Writes the names of the cell into its row.
void name_row(CellRow& row, const Experiment& experiment, const CellIndex& cell);
/// The row of a cell that failed because of `reason`.
CellRow failed_row(const Experiment& experiment, const CellIndex& cell, const std::string& reason, int tries);

/// For each node, a digest of everything that its result depends on, as far as this is known before the run. Nodes with
/// equal digests give equal results. `case_name` stands for all data that paths name and for the seed of random nodes.
std::vector<Digest> histories(const Pipeline& pipeline, const std::string& case_name);

/// Whether the result of a node is different for another case, or for another start, of the same variant.
struct Dependence {
  bool on_case = false, on_start = false;
};
std::vector<Dependence> dependences(const Pipeline& pipeline, const Experiment& experiment);

/// What cells depend on besides the texts of the experiment and its pipelines, in the state in which it was read.
struct Dependencies {
  std::map<std::string, std::string> contents;  ///< digest of what each path names
  std::map<std::string, Digest> builds;         ///< build ids of the plugins, by node
};
/// The first plugin (in words) or path that has changed since; empty if nothing has changed.
std::string first_change(const Dependencies& before, const Catalogue& now);

/// Runs cells of one experiment. Results go to FOLDER/cells/ID/ (poses, figures, the run's record). The row,
/// FOLDER/cells/ID/cell.json, is written last and as a whole. Pictures go to FOLDER/pictures/ID/.
class CellRunner {
 public:
  CellRunner(const Experiment& experiment, const Catalogue& catalogue, const Store* store, std::filesystem::path folder,
             int threads, const FileLimits& file_limits = {});

  /// The seed of the runs of a case.
  std::uint64_t seed_of(std::size_t case_index) const;
  /// Where a case is, or will be after its simulation. Empty if the pipeline makes its data itself.
  std::filesystem::path case_place(std::size_t case_index) const;
  /// The folder of a case. A simulated case is made if it is not in the store yet. Throws Error if that fails.
  std::filesystem::path case_folder(std::size_t case_index);
  /// From now on, each path is read only once. Call this in a process whose cells are run by other processes, so that
  /// all of them get the same keys.
  void keep_dependencies() { keeps_dependencies_ = true; }
  /// What was read since keep_dependencies().
  const Dependencies& dependencies() const { return dependencies_; }
  /// The key of everything that a run of the cell, and its row, depend on. Empty if it cannot be computed; the run then
  /// says why.
  std::string key_of(const CellIndex& cell);
  /// The existing row of the cell, if it is whole, did not fail and has this key.
  std::optional<CellRow> finished(const CellIndex& cell, const std::string& key) const;
  /// Why the cell's file is not a row that marrow wrote; empty if it is one, or if there is no file.
  std::string fault_of_row(const CellIndex& cell) const;
  /// Runs the cell. Does not throw if a node fails: the row then has the reason.
  CellRow run(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer = {});
  /// Runs the cell again for its pictures, landscape and scene; its other nodes are read back from the store. Returns
  /// false if the pictures are there already. Throws Error if a node fails, if a file that the cell needs changes, or
  /// if the folder cannot be written.
  bool draw(const CellIndex& cell, const std::function<void(const RunEvent&)>& observer = {});
  /// Seconds that a run of the cell takes if the results that all variants share are read back and all others are made
  /// again; without a store, everything is made again. The cell runs once before the measurement. The time is measured
  /// only once: later calls with the same variants and number of threads find it in the store. Throws Error if a run
  /// fails.
  double time(const CellIndex& cell);
  std::filesystem::path pictures_of(const CellIndex& cell) const;
  /// The names of the items along an axis, in the case of a cell. Runs only the node that names the items, and what
  /// this node needs. Empty if the case has no such list. Throws Error if a node fails.
  std::vector<std::string> items_of(const CellIndex& cell, const NamedItem& asked);
  /// Writes the row where finished() finds it. If it cannot be written, the row becomes a failed one, so that only this
  /// cell is lost.
  void write(const CellIndex& cell, CellRow& row) const;
  std::filesystem::path folder_of(const CellIndex& cell) const;
  const Experiment& experiment() const { return experiment_; }
  enum class Depth { figures, pictures };
  /// The pipeline of a cell. It keeps the outputs that are poses or verdicts or that the experiment's metrics need;
  /// with Depth::pictures, also those that people look at.
  Pipeline pipeline_of(const CellIndex& cell, const std::filesystem::path& case_folder, Depth depth) const;
  /// What makes a run of this pipeline of the cell again.
  RunRecipe recipe_of(const CellIndex& cell, const Pipeline& pipeline) const;

 private:
  enum class Look { may_be_kept, anew };
  std::string content_of(const std::string& path, Look look) const;
  void add_pipeline(Hasher& hasher, const Pipeline& pipeline, const std::filesystem::path& case_folder,
                    Look look) const;
  std::string key_of(const CellIndex& cell, const Pipeline& pipeline);
  /// What a run depends on, and the times of its files. It changes if any file is written to, even if the file has the
  /// same content again.
  struct Watched {
    Digest states;
    std::string key;
    bool operator==(const Watched&) const = default;
  };
  Watched watched(const CellIndex& cell, const Pipeline& pipeline);
  std::filesystem::path place_of_simulated(std::size_t case_index, Look look) const;
  struct Done {
    RunResult result;
    std::string fault;  ///< fault of the first node that failed, or of an output that could not be written
  };
  RunSettings settings_of(const CellIndex& cell) const;
  Done run_into(const std::filesystem::path& folder, const Pipeline& pipeline, const CellIndex& cell,
                const std::function<void(const RunEvent&)>& observer);
  void fill(CellRow& row, const Pipeline& pipeline, const Done& done) const;
  Pipeline simulation_of(std::size_t case_index) const;
  /// What is known of all variants on one case from one start.
  struct OfAllVariants {
    std::optional<std::pair<std::size_t, std::size_t>> place;  ///< case and start
    std::map<Digest, std::size_t> variants_with;               ///< how many have a node, by its history
    Digest keys;                                               ///< of the keys of all their cells
  };
  /// Kept until another case or start is asked for.
  const OfAllVariants& of_all_variants(const CellIndex& cell);
  /// For each node of the cell, how many variants have it with the same result.
  std::vector<std::size_t> variants_with_nodes(const CellIndex& cell, const Pipeline& pipeline);
  /// The nodes of the cell that are not common to all variants. If there is only one variant, all nodes.
  std::set<std::string> own_nodes(const CellIndex& cell, const Pipeline& pipeline);
  /// The nodes of the cell that others have too: other variants, starts or cases of the experiment.
  const std::set<std::string>& wanted_by_others(const CellIndex& cell, const Pipeline& pipeline);
  /// Copies a simulated case from the shared store, or makes it, once among all hosts.
  void make_case(std::size_t case_index, const std::filesystem::path& folder) const;
  void simulate(std::size_t case_index, const std::filesystem::path& folder) const;
  /// Gives a case that was made elsewhere its name in the store.
  void put_case(std::size_t case_index, const std::filesystem::path& made, const std::filesystem::path& folder) const;

  const Experiment& experiment_;
  const Catalogue& catalogue_;
  const Store* store_;
  std::filesystem::path folder_;
  int threads_;
  FileLimits file_limits_;
  bool keeps_dependencies_ = false;
  mutable Dependencies dependencies_;
  mutable std::map<std::size_t, std::filesystem::path>
      places_;  ///< places of simulated cases, if dependencies are kept
  struct FoundCase {
    std::filesystem::path outputs;
    std::shared_ptr<const void> use;  ///< as long as it lives, the store does not remove the folder
  };
  std::map<std::size_t, FoundCase> simulated_;
  std::map<std::size_t, std::set<std::string>> wanted_;  ///< by variant
  OfAllVariants of_all_variants_;
};

}  // namespace compare
}  // namespace marrow
