// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "marrow/runtime/pipeline.hpp"

namespace marrow::compare {

/// One way of doing it: what is changed in the pipeline.
struct Variant {
  std::string name;
  Place place;
  std::vector<Override> overrides;
};

/// Data to try all variants on: a folder that is there, a simulation that makes one, or neither: the pipeline makes its
/// data itself, by the seed of its run.
struct ExperimentCase {
  std::string name;
  std::filesystem::path folder;  ///< empty where there is none yet
  bool is_simulated = false;
  std::uint64_t seed = 1;  ///< of the simulation; where there is none, of the runs
};

/// An input of the simulation that is drawn uniformly.
struct DrawnInput {
  std::string name;
  std::array<double, 2> range{};
  Place place;
};

/// The pipeline that makes cases, and where the values of its inputs come from.
struct CaseSimulation {
  std::filesystem::path pipeline;  ///< empty where there is none
  std::string output;
  std::vector<Override> changes;   ///< of the pipeline, for all cases
  std::vector<InputValue> inputs;  ///< the same for all cases
  std::vector<DrawnInput> drawn;
  std::vector<std::pair<std::string, Place>> seed_inputs;  ///< inputs that take the case's seed
};

/// A displacement of the start, about and along the fragment's frontal, lateral and long axes through its centroid.
struct Start {
  std::string name;
  std::array<double, 3> rotation_deg{}, translation_mm{};
  double distance_mm = 0;  ///< to which the displacement is scaled; 0 = as it is
};

/// How starts are drawn: the direction of the rotation vector and of the translation uniform on the sphere, the angle
/// and the length uniform in [0, limit]. With a distance, the displacement is then scaled until the surface has moved
/// by a mean distance that is uniform in [0, limit]: the starts of a capture range fall evenly into its bins.
struct StartProtocol {
  std::string node;  ///< whose options rotation_deg, translation_mm and distance_mm are set
  std::size_t count = 0;
  std::uint64_t seed = 1;
  double rotation_deg = 0, translation_mm = 0, distance_mm = 0;
  Place place;
};

/// A figure of merit: output.item....figure, as in errors.distal.final.mtre_mm.
struct MetricChoice {
  std::string path;
  std::string label;                                  ///< for people; the path where the experiment gives none
  enum class Better { lower, higher, nearest_zero };  ///< of nearest_zero, the magnitude is compared
  Better better = Better::lower;
  std::optional<double> limit;  ///< of success: below it, or above it where higher is better

  bool higher_is_better() const { return better == Better::higher; }
};

/// An experiment of more is a fault of its file. Each variant's pipeline is read whenever the experiment is.
inline constexpr std::size_t kMostVariants = 1000;
inline constexpr std::size_t kMostCells = 1000000;
inline constexpr std::size_t kMostMetrics = 1000;

struct Experiment {
  std::string name, help;
  std::filesystem::path file;
  std::string text;  ///< of the file
  std::filesystem::path pipeline;
  std::vector<InputValue> inputs;  ///< of the pipeline, the same in every cell
  std::vector<Override> common;    ///< changes of the pipeline for all variants, before their own
  std::string case_input;          ///< the pipeline's input that a case's folder is given to, where it has one
  Place cases_place;
  CaseSimulation simulation;
  std::vector<ExperimentCase> cases;
  std::vector<Variant> variants;
  std::size_t baseline = 0;
  std::optional<StartProtocol> protocol;
  std::vector<Start> starts;  ///< one without displacement where there is no protocol
  std::vector<MetricChoice> metrics;
  std::string initial_error;          ///< path of the figure that the capture range is drawn over; may be empty
  std::vector<std::string> pictures;  ///< outputs to show side by side
  std::size_t timed_cells = 3;        ///< per variant, run again one at a time to measure their time

  std::size_t cell_count() const { return variants.size() * cases.size() * starts.size(); }
};

/// One run of a comparison.
struct CellIndex {
  std::size_t variant = 0, case_index = 0, start = 0;
};
/// All cells: by case, then by start, then by variant.
std::vector<CellIndex> cells_of(const Experiment& experiment);
/// "canny/case-03/0", as `marrow cell` takes it.
std::string cell_id(const Experiment& experiment, const CellIndex& cell);
/// Nothing for a name that is none of the experiment's.
std::optional<CellIndex> cell_of(const Experiment& experiment, const std::string& id);

/// The pipeline of a cell; `case_folder` is where its case lies.
PipelineArguments arguments_of(const Experiment& experiment, const CellIndex& cell,
                               const std::filesystem::path& case_folder);

/// The simulation's pipeline, where it makes this case.
PipelineArguments simulation_arguments_of(const Experiment& experiment, std::size_t case_index);

/// Reads and checks an experiment and the pipelines that it names, with each variant's changes. All faults go to
/// `diagnostics`, at their lines; the result may be used only when there are none.
Experiment read_experiment(const std::filesystem::path& file, const Catalogue& catalogue, Diagnostics& diagnostics);

}  // namespace marrow::compare
