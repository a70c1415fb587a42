// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/compare/stop_rule.hpp"
#include "marrow/runtime/pipeline/pipeline.hpp"

namespace MARROW_EXPORT marrow {
namespace compare {

/// One variant of the pipeline, given by its changes.
struct Variant {
  std::string name;
  Place place;
  std::vector<Override> overrides;
  std::vector<double> swept = {};  ///< values of the experiment's swept options, in their order
  std::string swept_from = {};     ///< the variant whose options are swept; empty if it is the pipeline as it is
  /// For each of the experiment's factors the place of its level; empty for a variant that 'matrix' did not make.
  std::vector<std::size_t> levels = {};
};

/// What 'matrix' varies: an option, or the named variants with which it is combined. A variant has one level of each.
struct Factor {
  std::string name;                 ///< the option's key; "variants" for the named variants
  std::vector<std::string> levels;  ///< the values in the order of the file
};

/// Data on which all variants run. It is a folder that exists, or a folder that a simulation makes. Without either, the
/// pipeline makes its data itself, from the seed of its run.
struct ExperimentCase {
  std::string name;
  std::filesystem::path folder;  ///< empty if there is none yet
  bool is_simulated = false;
  std::uint64_t seed = 1;  ///< seed of the simulation; without a simulation, seed of the runs
};

/// An input of the simulation that is drawn uniformly from a range.
struct DrawnInput {
  std::string name;
  std::array<double, 2> range{};
  Place place;
  bool is_whole = false;  ///< rounded to a whole number
};

/// Inputs of a pipeline that differ between cases with seeds.
struct SeededInputs {
  std::vector<DrawnInput> drawn;
  std::vector<std::pair<std::string, Place>> taking_seed;  ///< inputs that take the case's seed
};

/// The pipeline that makes cases, and where the values of its inputs come from.
struct CaseSimulation {
  std::filesystem::path pipeline;  ///< empty if there is none
  std::string output;
  std::vector<Override> changes;   ///< changes of the pipeline, for all cases
  std::vector<InputValue> inputs;  ///< the same for all cases
  SeededInputs seeded;
};

/// A displacement of the start pose: rotations about, and translations along, the fragment's frontal, lateral and long
/// axes through its centroid.
struct Start {
  std::string name;
  std::array<double, 3> rotation_deg{}, translation_mm{};
  double distance_mm = 0;  ///< mean distance to which the displacement is scaled; 0 = it is not scaled
};

/// How starts are drawn. The directions of the rotation vector and of the translation are uniform on the sphere; the
/// angle and the length are uniform in [0, limit]. With a distance, the displacement is then scaled until the surface
/// has moved by a mean distance that is uniform in [0, limit]. So the starts are spread evenly over the bins of a
/// capture range.
struct StartProtocol {
  std::string node;  ///< the node whose options rotation_deg, translation_mm and distance_mm are set
  std::size_t count = 0;
  std::uint64_t seed = 1;
  double rotation_deg = 0, translation_mm = 0, distance_mm = 0;
  Place place;
};

/// A figure of merit. Its path is output.item....figure, as in errors.distal.final.mtre_mm.
struct MetricChoice {
  std::string path;
  std::string label;                                  ///< name for people; the path if the experiment gives none
  enum class Better { lower, higher, nearest_zero };  ///< for nearest_zero, the magnitude is compared
  Better better = Better::lower;
  std::optional<double> limit;  ///< limit of success: below it, or above it if higher is better
  Place place = {};

  bool higher_is_better() const { return better == Better::higher; }
};

/// An item that the path of a figure names, and the node that names the items along its axis. Only a case shows which
/// items exist (CellRunner::items_of).
struct NamedItem {
  std::string path, item, axis;
  Place place;
  std::size_t variant = 0;  ///< the first variant that has this node as it is
  std::string node;         ///< in its pipeline
  int output = 0;           ///< of the node
};

/// Limits of an experiment; more is a fault of its file. Reading an experiment reads the pipeline of each variant.
inline constexpr std::size_t kMostVariants = 1000;
inline constexpr std::size_t kMostCells = 1000000;
inline constexpr std::size_t kMostMetrics = 1000;
inline constexpr std::size_t kMostComparisons = 20000;  ///< of pairs, with 'compare_all'

/// An option whose numbers are tried over a range.
struct SweptOption {
  std::string key;  ///< node.option
  std::array<double, 2> range{};
  bool is_log = false;    ///< spread evenly over the logarithm
  bool is_whole = false;  ///< rounded to whole numbers
  Place place;

  /// The value at a fraction, 0 to 1, of the range.
  double value_at(double fraction) const;
  /// The fraction of the range at which a value lies; 0 below it, 1 above it.
  double fraction_of(double value) const;
};

/// How numbers of options are chosen: an optimizer tries points on the first cases, the training cases. The others are
/// held out: on them the chosen point is compared with the variants of the file.
struct TuneRule {
  std::vector<SweptOption> options;
  std::size_t variant = 0;  ///< the one whose options are tuned
  std::size_t metric = 0;   ///< the figure whose mean over the training cases and starts is made as good as possible
  double failed_as = 0;     ///< counts for a failed run in that mean, and for a worse one; a magnitude for nearest_zero
  std::string optimizer;    ///< name of the node that chooses the points
  std::vector<std::pair<std::string, std::string>> optimizer_options;  ///< as texts in YAML
  Place optimizer_place;
  std::size_t points = 0;  ///< the most that the optimizer may try
  std::size_t training_cases = 0;

  /// The values of the options at fractions of their ranges, rounded to about a thousandth of the range. So names are
  /// short, and points that are nearly equal become one.
  std::vector<double> values_at(const std::vector<double>& fractions) const;
};

struct Experiment {
  std::string name, help;
  std::filesystem::path file;
  std::string text;                          ///< text of the file
  std::vector<std::filesystem::path> files;  ///< all that it was read from, also those of its pipelines
  std::filesystem::path pipeline;
  std::vector<InputValue> inputs;  ///< inputs of the pipeline, the same in every cell
  std::vector<Override> common;    ///< changes of the pipeline for all variants, applied before their own
  std::string case_input;          ///< the pipeline's input that gets the folder of the case, if it has one
  Place cases_place;
  CaseSimulation simulation;
  SeededInputs seeded;  ///< of the pipeline itself, where it makes its data and the cases are seeds
  std::vector<ExperimentCase> cases;
  std::size_t more_cases = 0;  ///< number of cases at the end that the file does not name
  std::vector<Variant> variants;
  std::vector<Factor> factors;  ///< of 'matrix', in which all levels are combined; none without one
  bool compare_all = false;     ///< every pair of variants is compared, not only each with the baseline
  Place compare_all_place;
  std::vector<SweptOption> swept;
  bool sweep_is_grid = false;  ///< else Sobol's points
  std::size_t baseline = 0;
  std::optional<StartProtocol> protocol;
  std::vector<Start> starts;  ///< one without displacement if there is no protocol
  std::vector<MetricChoice> metrics;
  std::string initial_error;  ///< path of the figure over which the capture range is drawn; may be empty
  Place initial_error_place;
  std::vector<NamedItem> named_items;  ///< of the metrics and the initial error, except items that only a search names
  std::vector<std::string> pictures;   ///< outputs to show side by side
  std::optional<StopRule> stop;        ///< when a comparison with more and more cases ends
  std::optional<TuneRule> tune;        ///< how a further variant is found
  std::size_t timed_cells = 3;         ///< cells per variant that are run again, one at a time, to measure their time
  std::vector<std::string> notes;      ///< remarks for people that hold for the pipelines of all variants

  std::size_t cell_count() const { return variants.size() * cases.size() * starts.size(); }
  /// Whether a figure has a limit under 'success'. Without one, no run is a success, and none is a miss.
  bool defines_success() const {
    for (const MetricChoice& metric : metrics)
      if (metric.limit) return true;
    return false;
  }
};

/// One cell of a comparison: a variant, a case and a start.
struct CellIndex {
  std::size_t variant = 0, case_index = 0, start = 0;
};
/// All cells, sorted by case, then by start, then by variant.
std::vector<CellIndex> cells_of(const Experiment& experiment);
/// The name of a cell, as `marrow cell` takes it: "canny/case-03/0".
std::string cell_id(const Experiment& experiment, const CellIndex& cell);
/// The cell with this name; nothing if the experiment has no such cell.
std::optional<CellIndex> cell_of(const Experiment& experiment, const std::string& id);

/// The arguments for the pipeline of a cell. `case_folder` is the folder of its case.
PipelineArguments arguments_of(const Experiment& experiment, const CellIndex& cell,
                               const std::filesystem::path& case_folder);

/// The arguments with which the simulation's pipeline makes this case.
PipelineArguments simulation_arguments_of(const Experiment& experiment, std::size_t case_index);

/// Adds the variant that has these values of the options under 'tune', and returns its name: "tuned+72.3+1.5".
std::string add_tuned(Experiment& experiment, const std::vector<double>& values);
/// Adds the tuned variant with this name. Returns false if no tuned variant of the experiment can have it.
bool add_tuned(Experiment& experiment, const std::string& name);
/// Leaves only the training cases, or only those that are held out.
void keep_training_cases(Experiment& experiment);
void keep_held_out_cases(Experiment& experiment);

/// Reads and checks an experiment and the pipelines that it names, with each variant's changes. All faults go to
/// `diagnostics`, at their lines; the result may be used only if there are none. `more_cases` further cases follow
/// those of the file. Their seeds follow the file's largest seed.
Experiment read_experiment(const std::filesystem::path& file, const Catalogue& catalogue, Diagnostics& diagnostics,
                           std::size_t more_cases = 0);

/// The comparisons that an experiment makes: one for each figure of each variant beside the baseline, or of each pair
/// with 'compare_all'. If an optimizer chooses options, the tuned variant is another one, and only the cases that are
/// held out count.
struct ComparisonCounts {
  std::size_t comparisons = 0, cases = 0;
  /// The fewest cases with which one of them can reach p < 0.05 (fewest_cases); 0 without comparisons.
  std::size_t fewest_cases = 0;
};
ComparisonCounts comparison_counts(const Experiment& experiment);

/// What an experiment cannot show although it can run, in sentences: differences with too few cases, a rule under
/// 'stop' that can never be met, a capture range without success. It takes some milliseconds for each look of the rule.
std::vector<std::string> notes_of(const Experiment& experiment);

}  // namespace compare
}  // namespace marrow
